"""Quick views: ten small training pictures per second and core, with the place on the body of each
pixel.

They train the body map. `bank` has poses of every recorded clip, `poses` draws and changes them,
`views` photographs a person at 256 pixels, `people` chooses the person of each block, and `dataset`
fills a folder with shards of 64 views. The same seed, split and number of a shard give the same
shard.
"""
