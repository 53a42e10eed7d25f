"""Pickles of numpy arrays from untrusted sources, read without running any code that they name."""

from __future__ import annotations

import io
import math
import pickle
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from a2v.errors import InputError
from a2v.io import brief, shorten

_PLAIN_KINDS = "biufcSU"
"""Kinds of numpy numbers and text; objects, structures and dates are refused."""


class _Forbidden(Exception):
    """Signals that a pickle refers to something other than arrays."""


class _NoClass:
    """Placeholder for `numpy.ndarray` where a pickle has the class as a value; it cannot be
    called."""


class _StoredArray:
    """joblib's placeholder of an array; the numbers follow in the stream (its format since
    0.10)."""

    def read(self, stream: io.BytesIO) -> np.ndarray:
        """Read the array, whose size is bounded by the rest of the file."""
        shape, order, dtype = (self.__dict__.get(name) for name in ("shape", "order", "dtype"))
        if (
            not isinstance(dtype, np.dtype)
            or dtype.kind not in _PLAIN_KINDS
            or not isinstance(shape, tuple)
            or order not in ("C", "F")
        ):
            raise _Forbidden(f"an array of {brief(dtype)} and shape {brief(shape)}")
        if not all(isinstance(n, int) and n >= 0 for n in shape):
            raise _Forbidden(f"an array of shape {brief(shape)}")
        if (
            self.__dict__.get("numpy_array_alignment_bytes") is not None
        ):  # since joblib 1.2: a byte that counts the padding
            stream.read(stream.read(1)[0])
        size = math.prod(shape) * dtype.itemsize
        data = stream.read(size) if size <= len(stream.getbuffer()) else b""
        if len(data) != size:
            raise EOFError(f"an array of shape {shape} and {dtype} is cut off")
        return np.frombuffer(data, dtype=dtype).reshape(shape, order=order)


def _array(kind: object, shape: object, code: object) -> np.ndarray:
    """Replacement of numpy's `_reconstruct`: an empty array, filled by its state afterwards."""
    if kind is not _NoClass:
        raise _Forbidden("an array of a foreign class")
    return np.empty(0, dtype=np.uint8)


def _dtype(code: object, *_: object) -> np.dtype:
    found = np.dtype(code) if isinstance(code, str) else None
    if found is None or found.kind not in _PLAIN_KINDS + "O":
        raise _Forbidden(f"the type {brief(code)}")
    return found


def _scalar(dtype: object, data: object) -> Any:
    if (
        not isinstance(dtype, np.dtype)
        or dtype.kind not in _PLAIN_KINDS
        or not isinstance(data, bytes)
        or len(data) != dtype.itemsize
    ):
        raise _Forbidden("a number of a foreign type")
    return np.frombuffer(data, dtype=dtype)[0]


def _encode(text: object, encoding: object = "latin1") -> bytes:
    """Replacement for bytes of protocol 2, which it stores as text."""
    if not isinstance(text, str) or encoding not in ("latin1", "latin-1"):
        raise _Forbidden("text in a foreign encoding")
    return text.encode("latin-1")


def _no_bytes() -> bytes:
    """Replacement for empty bytes of protocol 2."""
    return b""


def _from_buffer(data: object, dtype: object, shape: object, order: object) -> np.ndarray:
    """Replacement for arrays of protocol 5."""
    if (
        not isinstance(data, bytes | bytearray)
        or not isinstance(dtype, np.dtype)
        or dtype.kind not in _PLAIN_KINDS
    ):
        raise _Forbidden("an array of Python objects")
    return np.frombuffer(data, dtype=dtype).reshape(shape, order=order)  # type: ignore[call-overload, no-any-return]


_ALLOWED: dict[tuple[str, str], Any] = {
    ("collections", "OrderedDict"): OrderedDict,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _StoredArray,
    ("numpy", "ndarray"): _NoClass,
    ("numpy", "dtype"): _dtype,
    ("_codecs", "encode"): _encode,
    ("__builtin__", "bytes"): _no_bytes,
    **{(f"numpy.{core}.numeric", "_frombuffer"): _from_buffer for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _array for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
}


def _objects(shape: object, values: object) -> Any:
    """Return the values of an array of objects: one by itself (as `numpy.save` stores a dict), or a
    list."""
    if isinstance(values, list) and shape == () and len(values) == 1:
        return values[0]
    if isinstance(values, list) and isinstance(shape, tuple) and shape == (len(values),):
        return values
    raise _Forbidden("an array of Python objects")


class _ArrayUnpickler(pickle._Unpickler):
    """Python's own unpickler (the C version cannot be stopped inside the stream) with a list of
    allowed names."""

    stack: list[Any]
    memo: dict[int, Any]
    dispatch: ClassVar[dict[int, Callable[[Any], None]]] = dict(pickle._Unpickler.dispatch)

    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream, encoding="latin1")  # text of Python 2
        self.stream = stream

    def find_class(self, module: str, name: str) -> Any:
        """Allow only arrays and plain containers."""
        try:
            return _ALLOWED[module, name]
        except KeyError:
            raise _Forbidden(f"{module}.{name}") from None

    def load_build(self) -> None:
        """Set a state; only arrays, types and joblib's placeholders accept one."""
        state, target = self.stack.pop(), self.stack[-1]
        made: np.ndarray | np.dtype
        if isinstance(target, _StoredArray) and isinstance(state, dict):
            target.__dict__.update(
                {
                    key: state.get(key)
                    for key in ("shape", "order", "dtype", "numpy_array_alignment_bytes")
                }
            )
            made = target.read(self.stream)
        elif isinstance(target, np.ndarray) and isinstance(state, tuple) and len(state) == 5:
            _, shape, dtype, column_major, data = state
            if isinstance(dtype, np.dtype) and dtype.kind == "O":
                self._replace(target, _objects(shape, data))
                return
            data = data.encode("latin-1") if isinstance(data, str) else data  # Python 2
            if (
                not isinstance(dtype, np.dtype)
                or dtype.kind not in _PLAIN_KINDS
                or not isinstance(data, bytes)
            ):
                raise _Forbidden("an array of Python objects")
            made = np.frombuffer(data, dtype=dtype).reshape(
                shape, order="F" if column_major else "C"
            )
        elif (
            isinstance(target, np.dtype)
            and isinstance(state, tuple)
            and len(state) > 1
            and target.kind == "O"
        ):
            made = target
        elif (
            isinstance(target, np.dtype)
            and isinstance(state, tuple)
            and len(state) > 1
            and state[1] in ("<", ">", "=", "|")
        ):
            made = target.newbyteorder(state[1])
        else:
            raise _Forbidden(f"a state for {type(target).__name__}")
        self._replace(target, made)

    def _replace(self, target: object, made: Any) -> None:
        """Put the filled array in the place of the empty one."""
        self.stack[-1] = made
        for key in reversed(
            self.memo
        ):  # later references mean the filled array, which was memoized just now
            if self.memo[key] is target:
                self.memo[key] = made
                break

    dispatch[pickle.BUILD[0]] = load_build

    def load_bytearray(self) -> None:
        """Read mutable bytes; their size is bounded by the rest of the stream."""
        length = int.from_bytes(self.read(8), "little")  # type: ignore[attr-defined]
        if length > len(self.stream.getbuffer()):
            raise EOFError(f"{length} bytes are cut off")
        self.append(bytearray(self.read(length)))  # type: ignore[attr-defined]

    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray


def read_arrays_pickle(data: bytes, where: str) -> Any:
    """Read a pickle, or an uncompressed joblib file, of numbers, text, containers and numpy arrays.

    Nothing that the file names is imported or called: arrays are built from their bytes. An
    array of objects becomes a list; subclasses and every other class are refused.

    Parameters
    ----------
    data : bytes
        Content of the file; its size bounds the arrays.
    where : str
        Name of the file for messages.

    Raises
    ------
    InputError
        It is not such a file; the message has the forbidden name.
    """
    if data[:1] != pickle.PROTO:
        raise InputError(
            f"{where} is compressed, or not a pickle of Python 3; save it again with "
            "joblib.dump(value, path)"
        )
    try:
        return _ArrayUnpickler(io.BytesIO(data)).load()
    except _Forbidden as error:
        raise InputError(
            f"{where} was not opened: it refers to {shorten(error)}; only numpy arrays and plain "
            "values are read"
        ) from None
    except Exception as error:  # the unpickler raises errors of every kind for a damaged stream
        raise InputError(
            f"{where} is a damaged pickle ({type(error).__name__}: {shorten(error)})"
        ) from None
