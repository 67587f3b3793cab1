"""`python -m bristle` is the console script `bristle`."""

from bristle import main

main()
