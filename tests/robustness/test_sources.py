"""What the code of cdfctl may not use, read from its sources: pickle, eval, YAML's constructors, the wall clock."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import cdfctl

ROOT = Path(cdfctl.__file__).parent
UNSAFE_MODULES = {"pickle", "cPickle", "marshal", "shelve", "dill", "cloudpickle", "code", "imp"}
UNSAFE_CALLS = {
    "eval", "exec", "compile", "__import__", "os.system", "os.popen", "yaml.load", "yaml.load_all", "yaml.full_load",
    "yaml.unsafe_load", "torch.load", "joblib.load", "np.save", "np.fromfile",
}  # fmt: skip
# It looks how old its folders are, and a wrong clock costs a compilation.
CLOCK = {"cache.py"}


def trees() -> Iterator[tuple[str, ast.AST]]:
    for path in sorted(ROOT.rglob("*.py")):
        yield path.relative_to(ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def calls(tree: ast.AST) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def test_nothing_is_unpickled_or_evaluated() -> None:
    for name, tree in trees():
        for node in ast.walk(tree):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {module.split(".")[0] for module in modules} & UNSAFE_MODULES, name
        for called, node in calls(tree):
            assert called not in UNSAFE_CALLS, (name, node.lineno)
            words = {word.arg: ast.unparse(word.value) for word in node.keywords}
            assert called != "np.load" or words.get("allow_pickle") == "False", (name, node.lineno)
            assert words.get("shell") != "True", (name, node.lineno)


def test_the_clock_on_the_wall_decides_nothing() -> None:
    """Ages and waits are of clocks that cannot be set back."""
    wall = {"time.time", "time.time_ns", "datetime.now", "datetime.datetime.now"}
    seen = {name for name, tree in trees() for called, _ in calls(tree) if called in wall}
    assert seen <= CLOCK
