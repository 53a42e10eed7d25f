"""The body map: a network that predicts, for each pixel of a person's picture, its place on the
body and the depth of front and back, and 33 landmarks.

`networks` defines it on the layers of BlazePose (`blazepose`), which the wheel of mediapipe
contains. `train_bodymap` (`training`) trains it on the quick views of `a2v.lab.studio.quick`.
`export.bodymap` writes an ONNX file that runs without torch.
"""
