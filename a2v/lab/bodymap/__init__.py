"""The body map: a network that predicts for each pixel of a person's picture its place on the body
and the depth of front and back, and 33 landmarks.

`train_bodymap` (`training`) teaches it on the quick views of `a2v.lab.studio.quick`; `networks` has
it, on the layers of BlazePose (`blazepose`) that the wheel of mediapipe carries. `export.bodymap`
writes the ONNX file that runs without torch.
"""
