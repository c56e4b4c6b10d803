"""onnxruntime without its telemetry.

Official wheels keep an identity of the machine in the user's home and report to their maker who runs what, if they can.
Whether they do is read once, from the environment, when the library loads: so it is imported here alone.
"""

import os

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

import onnxruntime as onnxruntime
