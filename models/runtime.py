"""onnxruntime without its telemetry.

Official wheels store an identity of the machine in the user's home and report usage to their maker where they can. The
environment variable that turns this off is read once, when the library loads: so it is first imported here.
"""

import os

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")

import onnxruntime as onnxruntime
