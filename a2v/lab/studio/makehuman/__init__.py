"""The studio's second source of people: MakeHuman's free clothes, shoes, hair and skins on bodies
of any age and build.

`assets` reads the archive, `binding` fits clothes to a body, `hm08` is the body with all of its
vertices on the avatars' rig, and `people` draws persons and dresses them.
"""
