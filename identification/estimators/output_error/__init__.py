"""Output error: free runs of the model on a force that is taken for exact."""
