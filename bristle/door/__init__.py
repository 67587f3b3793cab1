"""The functions behind `import bristle`: what a command does, as a call. Inner; import them from `bristle`."""
