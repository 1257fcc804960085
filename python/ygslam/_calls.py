"""Wrong calls of the compiled classes, told in one line: nanobind prints every signature and every type."""
from __future__ import annotations

import ast
import difflib
import functools
import operator
import re
from collections.abc import Callable
from typing import Any


def _is_int(value: Any) -> bool:
    try:
        return abs(operator.index(value)) < 1 << 63  # numbers of NumPy, too
    except TypeError:
        return False


_ACCEPTED: dict[str, Callable[[Any], bool]] = {
    "int": _is_int,
    "float": lambda value: hasattr(value, "__float__") and not getattr(value, "ndim", 0),
    "str": lambda value: isinstance(value, str),
    "bool": lambda value: isinstance(value, bool),
    "None": lambda value: value is None}


def _told(name: str, wanted: str, value: Any) -> str | None:
    """What is wrong with the value; None where nothing is seen to be."""
    dimensions: int = getattr(value, "ndim", 0)
    choices = wanted.split(" | ")
    for choice in choices if "[" not in wanted else [wanted]:
        head, _, inside = choice.partition("[")
        head, inside = head.rpartition(".")[2], inside[:-1]
        is_accepted = _ACCEPTED.get(choice)
        if head == "Mapping" and isinstance(value, dict):
            key_type, _, value_type = inside.partition(", ")
            for key, one in value.items():
                told = _told(f"{name}: a key", key_type, key) or _told(f"{name}: {key!s:.99}", value_type, one)
                if told:
                    return told
            return None
        if head == "Sequence" and hasattr(value, "__len__") and not isinstance(value, (str, bytes, dict)):
            return next((told for k, one in enumerate(value) if (told := _told(f"{name}[{k}]", inside, one))), None)
        if head == "NDArray" and dimensions > 0 and str(value.dtype) in inside:
            return None
        if (is_accepted(value) if is_accepted else _kind(value) == choice):
            return None
    is_large = wanted == "int" and isinstance(value, int)
    return f"{name}: {wanted} is expected, not {'one so large' if is_large else _kind(value)}"


def _parameters(function: Any) -> ast.arguments | None:
    signatures: tuple[Any, ...] = getattr(function, "__nb_signature__", ())
    if len(signatures) != 1:
        return None
    try:
        parsed = ast.parse(re.sub(r"\\\d+", "...", signatures[0][0]) + ": ...").body[0]  # \\4: a default
    except SyntaxError:  # a default that is no Python
        return None
    return parsed.args if isinstance(parsed, ast.FunctionDef) else None


def _kind(value: Any) -> str:
    dtype = getattr(value, "dtype", None)
    if getattr(value, "ndim", 0):
        return f"an array of {dtype}"
    return f"{type(value).__name__} of {len(value)}" if isinstance(value, (list, tuple)) else type(value).__name__


def _fault(parameters: ast.arguments, args: tuple[Any, ...], given: dict[str, Any]) -> str:
    places = [*parameters.posonlyargs, *parameters.args]
    names = [one.arg for one in (*places, *parameters.kwonlyargs)]
    for name in given:
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            return f"no argument {name[:99]!r}" + (f": did you mean {near[0]}?" if near else "")
        if name in names[:len(args)]:
            return f"argument '{name}' is given twice"
    if len(args) > len(places):
        return f"{len(places) - 1} arguments without a name are taken, not {len(args) - 1}"
    values = {one.arg: value for one, value in zip(places, args)} | given
    needed = [one.arg for one in places[:len(places) - len(parameters.defaults)]]
    needed += [one.arg for one, default in zip(parameters.kwonlyargs, parameters.kw_defaults) if default is None]
    for name in needed:
        if name not in values:
            return f"argument '{name}' is missing"
    wanted = {one.arg: ast.unparse(one.annotation).replace("ygslam._core.", "")
              for one in (*places, *parameters.kwonlyargs) if one.annotation}
    for name, value in values.items():
        if name in wanted and (told := _told(name, wanted[name], value)):
            return told
    return "wrong arguments: " + ", ".join(f"{name} ({_kind(value)})" for name, value in values.items() if name in wanted)


def clear(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which tells a wrong call in one line."""
    @functools.wraps(function)
    def call(*args: Any, **given: Any) -> Any:
        try:
            return function(*args, **given)
        except TypeError as error:
            if "incompatible function arguments" not in str(error):
                raise
            parameters = _parameters(function)
            line = _fault(parameters, args, given) if parameters else str(error).splitlines()[0]
        raise TypeError(f"{name}(): {line}")
    return call


def clear_methods(kind: type) -> None:
    """The methods of a compiled class, but for its constructor, which only a subclass can take over."""
    for name, function in list(vars(kind).items()):
        if type(function).__name__ == "nb_method" and (name[0] != "_" or name == "__getitem__"):
            setattr(kind, name, clear(f"{kind.__name__}.{name}", function))
