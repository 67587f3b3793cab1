"""`python -m bristle` is the console script `bristle`."""

from bristle.cli import main

if __name__ == "__main__":
    main()
