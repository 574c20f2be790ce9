"""Arithmetic expressions: a text of an allow-list grammar, compiled to a list of instructions for a stack machine.

The text is parsed by Python's own parser and never evaluated by Python: every node of the syntax tree must be on the
list. `evolvent.kernels.expression` runs the instructions.
"""

from __future__ import annotations

import ast
import dataclasses
import itertools
import math
import operator
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from evolvent.kernels import expression as run
from evolvent_base.errors import InputError, nearest

#: Longest text, deepest nesting, and the number of values that the stack machine holds.
LENGTH, NESTING, STACK = 1000, 100, 32
#: Largest size of a constant, and largest exponent that is a whole number.
LARGEST, EXPONENT = 1e100, 64

_ARITHMETIC: dict[type, tuple[int, Callable[[float, float], float]]] = {
    ast.Add: (run.ADD, operator.add),
    ast.Sub: (run.SUBTRACT, operator.sub),
    ast.Mult: (run.MULTIPLY, operator.mul),
    ast.Div: (run.DIVIDE, operator.truediv),
    ast.Pow: (run.POWER, operator.pow),
}
_COMPARISONS: dict[type, tuple[int, Callable[[float, float], bool]]] = {
    ast.Lt: (run.LESS, operator.lt),
    ast.LtE: (run.LESS_EQUAL, operator.le),
    ast.Gt: (run.GREATER, operator.gt),
    ast.GtE: (run.GREATER_EQUAL, operator.ge),
    ast.Eq: (run.EQUAL, operator.eq),
    ast.NotEq: (run.NOT_EQUAL, operator.ne),
}


def sign(value: float) -> float:
    """-1, 0 or 1."""
    return float((value > 0.0) - (value < 0.0))


def where(condition: float, one: float, other: float) -> float:
    """`one` where the condition holds, else `other`."""
    return one if condition else other


#: Functions: instruction, number of arguments (0: two or more), and the function of numbers.
FUNCTIONS: dict[str, tuple[int, int, Callable[..., float]]] = {
    "where": (run.WHERE, 3, where),
    "min": (run.MIN, 0, min),
    "max": (run.MAX, 0, max),
    "abs": (run.ABS, 1, abs),
    "sign": (run.SIGN, 1, sign),
    "sqrt": (run.SQRT, 1, math.sqrt),
    "sin": (run.SIN, 1, math.sin),
    "cos": (run.COS, 1, math.cos),
    "tan": (run.TAN, 1, math.tan),
    "exp": (run.EXP, 1, math.exp),
    "log": (run.LOG, 1, math.log),
    "tanh": (run.TANH, 1, math.tanh),
    "atan2": (run.ATAN2, 2, math.atan2),
}
CONSTANTS = {"pi": math.pi}
#: Functions that change over where two of their arguments, or the argument and 0, are equal; most linear functions of
#: which an expression is taken to consist.
_SWITCHES, MOST_LINES = ("min", "max", "abs", "sign"), 64
ALLOWED = (
    "allowed are numbers, names, + - * / **, parentheses, pi, the functions "
    + ", ".join(FUNCTIONS)
    + ", and comparisons as the first argument of where"
)
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")


@dataclasses.dataclass(frozen=True)
class Program:
    """A compiled expression.

    Attributes
    ----------
    text : str
    code : tuple of float, the instructions, and before them how many numbers they take
    corners : tuple of float, times that `t` is compared with, at which the value may jump
    """

    text: str
    code: tuple[float, ...]
    corners: tuple[float, ...]


def is_name(text: Any) -> bool:
    """Whether a text can name a constant of an expression."""
    return isinstance(text, str) and _NAME.fullmatch(text) is not None and text not in FUNCTIONS | CONSTANTS


def check_grammar(text: Any) -> str:
    """The text of an expression, with single blanks; refused unless its grammar is allowed.

    Raises
    ------
    ValueError
        Whose message ends the sentence "... is 'text'; ...".
    """
    tidy = _tidy(text)
    _Compiler(tidy, None, {}).run()
    return tidy


def names(text: str) -> set[str]:
    """Names in an expression that `check_grammar` has read: of variables, constants and functions."""
    return {node.id for node in ast.walk(ast.parse(text, mode="eval")) if isinstance(node, ast.Name)}


def compile_expression(
    text: Any, variables: Sequence[str], constants: Mapping[str, float] | None = None, *, name: str = "the expression"
) -> Program:
    """Compile an expression.

    Parameters
    ----------
    text : str
    variables : sequence of str, in the order of the values with which it is evaluated
    constants : mapping of names to numbers, SI units
    name : str, the key that holds the text, for messages

    Raises
    ------
    InputError
        One sentence with the position in the text and what is allowed.
    """
    constants = dict(constants or {})
    for key in constants:
        if key in variables or not is_name(key):
            raise InputError(f"the constant {key!r} of {name} has a name that is taken; give it another one")
    try:
        tidy = _tidy(text)
        compiler = _Compiler(tidy, tuple(variables), {**CONSTANTS, **constants})
        code = compiler.run()
    except ValueError as error:
        raise InputError(f"{name} is {_short(text)}; {error}") from None
    return Program(tidy, (float(len(code)), *code), tuple(sorted(compiler.corners)))


def corners_of(text: str, constants: Mapping[str, float] | None = None) -> list[float]:
    """Times at which an expression that has been compiled may go over into another one, by functions linear in t.

    Those are arguments of where, min, max, abs and sign, which change over where two of them are equal.
    """
    known, found = {**CONSTANTS, **(constants or {})}, set[float]()
    for node in ast.walk(ast.parse(text, mode="eval")):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            pairs = list(itertools.pairwise(sides))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _SWITCHES:
            pairs = list(itertools.combinations([*node.args, ast.Constant(0.0)][: max(2, len(node.args))], 2))
        else:
            continue
        for one, other in pairs:
            for (a, b), (c, d) in itertools.product(_lines(one, known), _lines(other, known)):
                if a != c and math.isfinite(time := (d - b) / (a - c)):
                    found.add(time)
    return sorted(found)


def _lines(node: ast.AST, known: Mapping[str, float]) -> list[tuple[float, float]]:
    """Slope and value at t = 0 of the linear functions of t of which an expression may consist; none where unknown."""
    match node:
        case ast.Constant():
            return [(0.0, float(node.value))]  # type: ignore[arg-type]
        case ast.Name():
            return [(1.0, 0.0)] if node.id == "t" else [(0.0, known[node.id])] if node.id in known else []
        case ast.UnaryOp():
            sign_of = -1.0 if isinstance(node.op, ast.USub) else 1.0
            return [(sign_of * a, sign_of * b) for a, b in _lines(node.operand, known)]
        case ast.BinOp():
            pairs = itertools.product(_lines(node.left, known), _lines(node.right, known))
            return [line for one, other in pairs if (line := _combined(node.op, one, other))][:MOST_LINES]
        case ast.Call(func=ast.Name(id="where" | "min" | "max" as name)):
            own = node.args[1:] if name == "where" else node.args
            return [line for one in own for line in _lines(one, known)][:MOST_LINES]
        case ast.Call(func=ast.Name(id="abs")):
            return [(s * a, s * b) for a, b in _lines(node.args[0], known) for s in (1.0, -1.0)][:MOST_LINES]
    return []


def _combined(op: ast.AST, one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float] | None:
    """A linear function of t from two by an operation; None where it is none."""
    (a, b), (c, d) = one, other
    match op:
        case ast.Add():
            return a + c, b + d
        case ast.Sub():
            return a - c, b - d
        case ast.Mult() if a == 0.0 or c == 0.0:
            return a * d + b * c, b * d
        case ast.Div() if c == 0.0 and d != 0.0:
            return a / d, b / d
    return None


def is_true(text: Any, values: Mapping[str, float], *, name: str = "the comparison") -> bool:
    """Whether a comparison of named numbers, or a chain of them, is true: "0.1 < x <= 2 * y".

    Raises
    ------
    InputError
        One sentence with the position in the text and what is allowed.
    """
    try:
        compiler = _Compiler(_tidy(text), (), {**CONSTANTS, **values})
        found, _ = compiler.condition()
    except ValueError as error:
        raise InputError(f"{name} is {_short(text)}; {error}") from None
    assert not isinstance(found, list)  # all names are constants
    return found == 1.0


def _short(text: Any) -> str:
    shown = repr(text)
    return shown if len(shown) <= 80 else shown[:77] + "..."


def _tidy(text: Any) -> str:
    if not isinstance(text, str):
        raise ValueError("it must be a text such as '-k*x - k3*x**3'")
    tidy = " ".join(text.split())
    if not tidy:
        raise ValueError("it is empty; give a text such as '-k*x - k3*x**3'")
    if len(tidy) > LENGTH:
        raise ValueError(f"it has {len(tidy)} characters; at most {LENGTH} are allowed")
    return tidy


class _Compiler:
    """Walks a syntax tree; `variables` None stands for any names."""

    def __init__(self, text: str, variables: tuple[str, ...] | None, constants: Mapping[str, float]) -> None:
        self.text, self.variables, self.constants = text, variables, constants
        self.corners: set[float] = set()

    def _tree(self) -> ast.AST:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return ast.parse(self.text, mode="eval").body
        except SyntaxError as error:
            raise ValueError(self._syntax(error)) from None
        except (ValueError, RecursionError, MemoryError):
            raise ValueError(f"it cannot be read; {ALLOWED}") from None

    def condition(self) -> tuple[list[float] | float, int]:
        """The whole text as a comparison, 1 or 0."""
        return self._condition(self._tree(), 1)

    def run(self) -> list[float]:
        """Instructions of the whole text."""
        found, depth = self._code(self._tree(), 1)
        if depth > STACK:
            raise ValueError(f"it holds {depth} values at a time; at most {STACK} are allowed: split it")
        return found if isinstance(found, list) else [run.CONSTANT, found]

    def _syntax(self, error: SyntaxError) -> str:
        at = min(max((error.offset or 1) - 1, 0), len(self.text))
        place = f"at character {at + 1}, before {self.text[at : at + 12]!r}" if at < len(self.text) else "at its end"
        return f"it cannot be read {place}; {ALLOWED}"

    def _refuse(self, node: ast.AST, why: str = f"is not allowed; {ALLOWED}") -> ValueError:
        part = ast.get_source_segment(self.text, node) or self.text
        part = part if len(part) <= 40 else part[:37] + "..."
        return ValueError(f"{part!r} at character {getattr(node, 'col_offset', 0) + 1} {why}")

    def _code(self, node: ast.AST, nesting: int) -> tuple[list[float] | float, int]:
        """Instructions of a node, or its value where that is constant; and the values that it holds at a time."""
        if nesting > NESTING:
            raise ValueError(f"it is nested more than {NESTING} deep; write it with fewer brackets and operators")
        match node:
            case ast.Constant():
                return self._number(node), 1
            case ast.Name():
                return self._name(node), 1
            case ast.UnaryOp(op=ast.USub()):
                inner, depth = self._code(node.operand, nesting + 1)
                return ([*inner, run.NEGATE], depth) if isinstance(inner, list) else (-inner, 1)
            case ast.UnaryOp(op=ast.UAdd()):
                return self._code(node.operand, nesting + 1)
            case ast.BinOp() if type(node.op) in _ARITHMETIC:
                return self._binary(node, nesting)
            case ast.BinOp(op=ast.BitXor()):
                raise self._refuse(node, "is not allowed; a power is written **")
            case ast.Call():
                return self._call(node, nesting)
            case ast.Compare():
                raise self._refuse(node, "is a comparison, which is allowed only as the first argument of where")
        raise self._refuse(node)

    def _number(self, node: ast.Constant) -> float:
        if isinstance(node.value, bool) or not isinstance(node.value, (int, float)):
            raise self._refuse(node)
        try:
            return self._checked(node, float(node.value))
        except OverflowError:
            return self._checked(node, math.inf)

    def _checked(self, node: ast.AST, value: float) -> float:
        if not abs(value) <= LARGEST:
            raise self._refuse(node, f"is not a finite number of at most {LARGEST:g}")
        return value

    def _name(self, node: ast.Name) -> list[float] | float:
        if node.id in FUNCTIONS:
            raise self._refuse(node, f"is a function; write {node.id}(...)")
        if self.variables is None:
            return CONSTANTS.get(node.id, [run.VARIABLE, 0.0])
        if node.id in self.constants:
            return float(self.constants[node.id])
        if node.id in self.variables:
            return [run.VARIABLE, float(self.variables.index(node.id))]
        known = {*self.variables, *self.constants}
        raise self._refuse(node, f"is neither a variable nor a constant; {nearest(node.id, known)}")

    def _fold(self, node: ast.AST, function: Callable[..., float], values: Sequence[float]) -> float:
        """Value of a function of constants."""
        try:
            result = function(*values)
        except (ArithmeticError, ValueError):
            result = math.inf
        return self._checked(node, float(result) if isinstance(result, (int, float)) else math.inf)

    def _binary(self, node: ast.BinOp, nesting: int) -> tuple[list[float] | float, int]:
        instruction, function = _ARITHMETIC[type(node.op)]
        left, depth_left = self._code(node.left, nesting + 1)
        right, depth_right = self._code(node.right, nesting + 1)
        if not isinstance(left, list) and not isinstance(right, list):
            return self._fold(node, function, (left, right)), 1
        if (
            instruction == run.POWER
            and isinstance(left, list)
            and not isinstance(right, list)
            and right == int(right)
            and abs(right) <= EXPONENT
        ):
            return [*left, run.INTEGER_POWER, right], depth_left
        return [*_operand(left), *_operand(right), instruction], max(depth_left, 1 + depth_right)

    def _call(self, node: ast.Call, nesting: int) -> tuple[list[float] | float, int]:
        if not isinstance(node.func, ast.Name) or node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise self._refuse(node)
        if node.func.id not in FUNCTIONS:
            raise self._refuse(node.func, f"is no function; {nearest(node.func.id, FUNCTIONS)}")
        instruction, count, function = FUNCTIONS[node.func.id]
        given = len(node.args)
        if given != count if count else given < 2:
            wanted = f"{count} argument{'s' if count > 1 else ''}" if count else "two or more arguments"
            raise self._refuse(node, f"has {given}; {node.func.id} takes {wanted}")
        if instruction == run.WHERE:
            found = [self._condition(node.args[0], nesting + 1)]
            found += [self._code(argument, nesting + 1) for argument in node.args[1:]]
        else:
            found = [self._code(argument, nesting + 1) for argument in node.args]
        values = [value for value, _ in found if not isinstance(value, list)]
        if len(values) == given:
            return self._fold(node, function, values), 1
        code: list[float] = []
        depth = 0
        for k, (inner, own) in enumerate(found):
            code += _operand(inner)
            depth = max(depth, own + (k if count else min(k, 1)))
            if not count and k > 0:
                code.append(instruction)
        return (code if not count else [*code, instruction]), depth

    def _condition(self, node: ast.AST, nesting: int) -> tuple[list[float] | float, int]:
        """A comparison, or a chain of them, as 1 or 0."""
        if not isinstance(node, ast.Compare) or any(type(op) not in _COMPARISONS for op in node.ops):
            raise self._refuse(node, "is no comparison such as t < 2")
        sides = [node.left, *node.comparators]
        found = [self._code(side, nesting + 1) for side in sides]
        numbers = [value for value, _ in found if not isinstance(value, list)]
        if len(numbers) == len(sides):
            pairs = zip(node.ops, numbers, numbers[1:], strict=False)
            return float(all(_COMPARISONS[type(op)][1](a, b) for op, a, b in pairs)), 1
        code: list[float] = []
        depth = 0
        for k, op in enumerate(node.ops):
            instruction, _ = _COMPARISONS[type(op)]
            (left, depth_left), (right, depth_right) = found[k], found[k + 1]
            self._corner(sides[k], right)
            self._corner(sides[k + 1], left)
            code += [*_operand(left), *_operand(right), instruction]
            depth = max(depth, min(k, 1) + max(depth_left, 1 + depth_right))
            if k > 0:
                code.append(run.MULTIPLY)
        return code, depth

    def _corner(self, side: ast.AST, other: list[float] | float) -> None:
        if isinstance(side, ast.Name) and side.id == "t" and not isinstance(other, list):
            self.corners.add(other)


def _operand(found: list[float] | float) -> list[float]:
    return found if isinstance(found, list) else [run.CONSTANT, found]
