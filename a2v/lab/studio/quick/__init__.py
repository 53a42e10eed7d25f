"""Quick views: ten small training pictures a second and core, with what each pixel shows of the
body; what the body map learns from.

`bank` holds poses of every recorded clip, `poses` draws and changes them, `views` photographs a
person at 256 pixels, `people` says who is photographed in which block, and `dataset` fills a folder
with shards of 64 views. The same seed, split and number of a shard give the same shard.
"""
