"""The shipped models, one ONNX file each, as package data."""
