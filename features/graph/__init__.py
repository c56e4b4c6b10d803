"""The model inputs as ONNX graph operators: what `inputs.model_inputs` computes, for runtimes without Python.

Every constant comes from the modules beside this folder, which hold the definitions; only the arithmetic is repeated,
in the operators of the standard. The tests compare every input with `model_inputs`. The modules need `onnx`, this
package alone does not.
"""
