"""PyTorch to ONNX, and `sample.py`, which needs numpy and onnxruntime only."""
