"""Things before, beside and in the hands of the studio's people: plain solids out of numpy, painted
at random, and free photographs behind.

`solids` are meshes of boxes and of profiles that turn about an axis, `paint` their patterns; `held`
is what hands grip, `furniture` what stands about, and `backgrounds` photographs of places.
`clutter` draws what is around one person, `framing` how much of the person is then seen.
"""
