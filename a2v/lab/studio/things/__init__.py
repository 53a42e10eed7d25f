"""Objects in front of, beside and in the hands of the studio's people, and photographs behind them.

Objects are plain solids made with numpy and painted randomly. `solids` has meshes of boxes and
surfaces of revolution, `paint` their patterns. `held` has objects in hands, `furniture` has
furniture, and `backgrounds` has free photographs of places. `clutter` draws the surroundings of one
person, and `framing` measures how much of the person is visible.
"""
