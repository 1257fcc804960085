"""Wrong calls of the compiled classes, told in one line: nanobind prints every signature and every type."""
from __future__ import annotations

import ast
import difflib
import functools
import re
from collections.abc import Callable
from typing import Any

_ACCEPTED: dict[str, Callable[[Any], bool]] = {  # numbers of NumPy, too
    "int": lambda value: hasattr(value, "__index__"),
    "float": lambda value: hasattr(value, "__float__") and not getattr(value, "ndim", 0),
    "str": lambda value: isinstance(value, str),
    "bool": lambda value: isinstance(value, bool)}


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
    return f"an array of {dtype}" if getattr(value, "ndim", 0) else type(value).__name__


def _fault(parameters: ast.arguments, args: tuple[Any, ...], given: dict[str, Any]) -> str:
    places = [*parameters.posonlyargs, *parameters.args]
    names = [one.arg for one in (*places, *parameters.kwonlyargs)]
    for name in given:
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            return f"no argument '{name}'" + (f": did you mean {near[0]}?" if near else "")
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
        is_accepted = _ACCEPTED.get(wanted.get(name, ""))
        if is_accepted and not is_accepted(value):
            return f"{name}: {wanted[name]} is expected, not {_kind(value)}"
    told = [f"{name}: {wanted[name]} is expected, not {_kind(value)}" for name, value in values.items()
            if name in wanted and wanted[name] not in (_kind(value), *_ACCEPTED)]
    return ", or ".join(told) or "wrong arguments"


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
