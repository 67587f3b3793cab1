"""Write the pictures of docs/models: python -m tools.gallery."""

from __future__ import annotations

from tools.gallery import write

if __name__ == "__main__":
    for file in write():
        print(file)
