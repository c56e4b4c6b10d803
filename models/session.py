"""Opens onnxruntime sessions on the CPU, all with the same options."""

from .runtime import onnxruntime


def quiet_session(onnx_bytes: bytes, threads: int = 1) -> onnxruntime.InferenceSession:
    """Open a model, silent on the terminal.

    Parameters
    ----------
    onnx_bytes
        A serialised ONNX model, one that may be trusted.
    threads
        Number of CPU threads that share a batch.

    Returns
    -------
    onnxruntime.InferenceSession
        Faults of a model are raised as exceptions; those of onnxruntime have no common base class.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # faults come as exceptions; nothing else may reach the user's terminal
    return onnxruntime.InferenceSession(
        onnx_bytes,
        options,
        providers=["CPUExecutionProvider"],
        enable_fallback=0,  # which would print, and try the same again
    )
