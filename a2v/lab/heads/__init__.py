"""The training of the network that completes heads: charts of heads, and photos of them."""
