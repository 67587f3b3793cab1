"""What a command says and where: words, one JSON object or nothing on stdout; progress and notes on stderr."""
