"""Training of the network that completes hidden colors."""
