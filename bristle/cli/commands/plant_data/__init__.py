"""Commands for data as plants have them: loops, standard tests, the next test, the years. One file a command."""
