"""Writes the types of the extension module, for editors and type checkers: make_stubs.py FOLDER

FOLDER holds the package as it was built; its _core.pyi is made from the docstrings. Options of a docstring become
keyword arguments.
"""
import ast
import importlib
import inspect
import pathlib
import re
import sys

NAMES = {"panonav._core.": "", "numpy.ndarray[": "numpy.ndarray[Any, ", "os.PathLike": "PathLike", "buffer": "Any"}
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w*)\((.*)\) -> (.+)$")
OPTION = re.compile(r"^    (\w+): (int|float|bool|str) = (.+)$", re.MULTILINE)


def clean(text: str) -> str:
    for shown, name in NAMES.items():
        text = text.replace(shown, name)
    text = re.sub(r"numpy\.ndarray\[Any, [\w.]+\]", "numpy.ndarray", text)
    return text.replace("PathLike", "Union[str, os.PathLike]") if "Union[str" not in text else text


def parameters(text: str, doc: str) -> str:
    """Writes parameters as Python does; defaults that are no literals become `...`."""
    parts, depth, part = [], 0, ""
    for letter in text + ",":
        depth += letter in "([{<"
        depth -= letter in ")]}>"
        if letter == "," and not depth:
            parts.append(part.strip())
            part = ""
        else:
            part += letter
    written = []
    for one in filter(None, parts):
        if one.startswith("self:") or one == "**kwargs":
            written.append("self" if one.startswith("self:") else "**kwargs")
            continue
        one = clean(one)
        name, equals, default = one.partition(" = ")
        if equals:
            try:
                ast.literal_eval(default)
            except (ValueError, SyntaxError):
                default = "..."
        written.append(name + equals + default)
    if "**kwargs" in written:
        options = [f"{name}: {kind} = {value}" for name, kind, value in OPTION.findall(doc)]
        written[-1:] = ([] if "*" in written or not options else ["*"]) + options
    return ", ".join(written)


def function(name: str, doc: str, indent: str) -> list:
    found = [SIGNATURE.match(line) for line in doc.splitlines()]
    found = [match for match in found if match and match.group(1) in (name, "")]
    numbered = [match for match in found if re.match(r"\d+\. ", match.group(0))]
    lines = []
    for match in numbered or found[:1]:
        if numbered:
            lines.append(f"{indent}@overload")
        lines.append(f"{indent}def {name}({parameters(match.group(2), doc)}) -> {clean(match.group(3))}: ...")
    return lines


def members(kind: type) -> list:
    lines = []
    for name, value in vars(kind).items():
        if isinstance(value, property):
            match = SIGNATURE.match((value.fget.__doc__ or "").split("\n")[0])
            lines += ["    @property", f"    def {name}(self) -> {clean(match.group(3)) if match else 'Any'}: ..."]
        elif callable(value) and getattr(value, "__doc__", None) and (name == "__init__" or name[0] != "_" or name in (
                "__len__", "__getitem__", "__iter__", "__mul__")):
            lines += function(name, value.__doc__, "    ")
    return lines or ["    ..."]


def stubs(module) -> str:
    lines = ["# Made by python/make_stubs.py.", "import os", "from typing import Any, Dict, Iterator, List, Optional, "
             "Tuple, Union, overload", "", "import numpy", "", "__version__: str"]
    lines += [f"{name}: Tuple[str, ...]" for name, value in sorted(vars(module).items()) if isinstance(value, tuple)]
    for name, value in sorted(vars(module).items()):
        if inspect.isclass(value):
            bases = ", ".join(base.__name__ for base in value.__bases__ if base.__module__ in ("builtins", "panonav")
                              and base is not object)
            lines += ["", f"class {name}({bases}):" if bases else f"class {name}:", *members(value)]
    for name, value in sorted(vars(module).items()):
        if inspect.isroutine(value):
            lines += ["", *function(name, value.__doc__, "")]
    text = "\n".join(lines) + "\n"
    ast.parse(text)
    return text


if __name__ == "__main__":
    sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
    made = stubs(importlib.import_module("panonav._core"))
    (pathlib.Path(sys.argv[1]) / "_core.pyi").write_text(made)
