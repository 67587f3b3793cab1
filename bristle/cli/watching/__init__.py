"""`bristle monitor` and `bristle replay`: one source or a plant of many, and the page that shows them."""
