"""Stack machine for expressions: the instructions of `evolvent.assembly.expressions`, held among a model's parameters.

A program is ``p[at]`` numbers long, from ``p[at + 1]``. The top of the stack is held apart, in a register.
"""

import math

from numba import config, types

from evolvent.compiled.jit import REAL, VECTOR, entry, inlined, kernel
from evolvent.compiled.views import local_vector

# instructions; CONSTANT, VARIABLE and INTEGER_POWER are followed by their operand
CONSTANT, VARIABLE, INTEGER_POWER, WHERE = 0, 1, 2, 3
ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, MIN, MAX, ATAN2 = 4, 5, 6, 7, 8, 9, 10, 11
LESS, LESS_EQUAL, GREATER, GREATER_EQUAL, EQUAL, NOT_EQUAL = 12, 13, 14, 15, 16, 17
NEGATE, ABS, SIGN, SQRT, SIN, COS, TAN, EXP, LOG, TANH = 18, 19, 20, 21, 22, 23, 24, 25, 26, 27


def _plain(function):
    """A function that returns not a number where plain Python raises, as compiled code does."""

    def guarded(*arguments):
        try:
            return function(*arguments)
        except (ArithmeticError, ValueError):
            return math.nan

    return guarded if config.DISABLE_JIT else function


sqrt, sin, cos, tan = _plain(math.sqrt), _plain(math.sin), _plain(math.cos), _plain(math.tan)
exp, log, raised = _plain(math.exp), _plain(math.log), _plain(math.pow)


@inlined
def _ratio(a, b):
    return a / b


ratio = _plain(_ratio)


@inlined
def whole_power(a, n):
    """The power a^n of a whole number n, by squaring."""
    base = a if n >= 0 else ratio(1.0, a)
    k = abs(n)
    result = 1.0
    while k > 0:
        if k & 1:
            result *= base
        base *= base
        k >>= 1
    return result


@inlined
def of_two(instruction, a, b):
    """Value of an instruction that takes two values."""
    if instruction == ADD:
        return a + b
    if instruction == SUBTRACT:
        return a - b
    if instruction == MULTIPLY:
        return a * b
    if instruction == DIVIDE:
        return ratio(a, b)
    if instruction == POWER:
        return raised(a, b)
    if instruction == MIN:
        return b if b < a else a
    if instruction == MAX:
        return b if b > a else a
    if instruction == LESS:
        return 1.0 if a < b else 0.0
    if instruction == LESS_EQUAL:
        return 1.0 if a <= b else 0.0
    if instruction == GREATER:
        return 1.0 if a > b else 0.0
    if instruction == GREATER_EQUAL:
        return 1.0 if a >= b else 0.0
    if instruction == EQUAL:
        return 1.0 if a == b else 0.0
    if instruction == NOT_EQUAL:
        return 1.0 if a != b else 0.0
    return math.atan2(a, b)


@inlined
def of_one(instruction, a):
    """Value of an instruction that takes one value."""
    if instruction == NEGATE:
        return -a
    if instruction == ABS:
        return abs(a)
    if instruction == SIGN:
        return 1.0 if a > 0.0 else (-1.0 if a < 0.0 else a)
    if instruction == SQRT:
        return sqrt(a)
    if instruction == SIN:
        return sin(a)
    if instruction == COS:
        return cos(a)
    if instruction == TAN:
        return tan(a)
    if instruction == EXP:
        return exp(a)
    if instruction == LOG:
        return log(a)
    return math.tanh(a)


@entry(VECTOR, types.int64, VECTOR)
@kernel
def evaluate(p, at, variables):
    """Value of the program at ``p[at]``; variables : (k,) float."""
    stack = local_vector()
    i, end = at + 1, at + 1 + int(p[at])
    top, a = 0, 0.0
    while i < end:
        instruction = int(p[i])
        i += 1
        if instruction <= VARIABLE:
            stack[top] = a
            top += 1
            a = p[i] if instruction == CONSTANT else variables[int(p[i])]
            i += 1
        elif instruction == INTEGER_POWER:
            a = whole_power(a, int(p[i]))
            i += 1
        elif instruction == WHERE:
            top -= 2
            if stack[top] != 0.0:
                a = stack[top + 1]
        elif instruction >= NEGATE:
            a = of_one(instruction, a)
        else:
            top -= 1
            a = of_two(instruction, stack[top], a)
    return a


@inlined
def slopes_of_one(instruction, a):
    """First and second derivative of an instruction that takes one value."""
    if instruction == NEGATE:
        return -1.0, 0.0
    if instruction == ABS:
        return (1.0 if a > 0.0 else (-1.0 if a < 0.0 else 0.0)), 0.0
    if instruction == SQRT:
        r = sqrt(a)
        return ratio(0.5, r), ratio(-0.25, a * r)
    if instruction == SIN:
        return cos(a), -sin(a)
    if instruction == COS:
        return -sin(a), -cos(a)
    if instruction == TAN:
        r = tan(a)
        return 1.0 + r * r, 2.0 * r * (1.0 + r * r)
    if instruction == EXP:
        return exp(a), exp(a)
    if instruction == LOG:
        return ratio(1.0, a), -ratio(1.0, a * a)
    if instruction == TANH:
        r = math.tanh(a)
        return 1.0 - r * r, -2.0 * r * (1.0 - r * r)
    return 0.0, 0.0


@inlined
def derivatives_of_two(instruction, a, a1, a2, b, b1, b2):
    """First and second derivative by t of an instruction that takes two values with such derivatives."""
    if instruction == ADD:
        return a1 + b1, a2 + b2
    if instruction == SUBTRACT:
        return a1 - b1, a2 - b2
    if instruction == MULTIPLY:
        return a1 * b + a * b1, a2 * b + 2.0 * a1 * b1 + a * b2
    if instruction == DIVIDE:
        first = ratio(a1 - ratio(a, b) * b1, b)
        return first, ratio(a2 - 2.0 * first * b1 - ratio(a, b) * b2, b)
    if instruction == POWER:
        if b1 == 0.0 and b2 == 0.0:
            slope = b * raised(a, b - 1.0) if a1 != 0.0 or a2 != 0.0 else 0.0
            bend = b * (b - 1.0) * raised(a, b - 2.0) if a1 != 0.0 else 0.0
            return slope * a1, bend * a1 * a1 + slope * a2
        whole, size, share = raised(a, b), log(a), ratio(a1, a)
        rate = b1 * size + b * share
        return whole * rate, whole * (rate * rate + b2 * size + 2.0 * b1 * share + b * (ratio(a2, a) - share * share))
    if instruction == MIN:
        return (b1, b2) if b < a else (a1, a2)
    if instruction == MAX:
        return (b1, b2) if b > a else (a1, a2)
    if instruction == ATAN2:
        square = a * a + b * b
        first = ratio(a1 * b - a * b1, square)
        return first, ratio(a2 * b - a * b2 - 2.0 * first * (a * a1 + b * b1), square)
    return 0.0, 0.0


@kernel
def evaluate_with_derivatives(p, at, variables, rates):
    """Value of a program, and its first and second derivatives along the direction `rates` of its variables."""
    values, firsts, seconds = local_vector(), local_vector(), local_vector()
    i, end = at + 1, at + 1 + int(p[at])
    top, a, a1, a2 = 0, 0.0, 0.0, 0.0
    while i < end:
        instruction = int(p[i])
        i += 1
        if instruction <= VARIABLE:
            values[top], firsts[top], seconds[top] = a, a1, a2
            top += 1
            a2 = 0.0
            if instruction == CONSTANT:
                a, a1 = p[i], 0.0
            else:
                a, a1 = variables[int(p[i])], rates[int(p[i])]
            i += 1
        elif instruction == INTEGER_POWER:
            n = int(p[i])
            slope = n * whole_power(a, n - 1) if n != 0 else 0.0
            bend = n * (n - 1) * whole_power(a, n - 2) if n != 0 and n != 1 else 0.0
            a, a1, a2 = whole_power(a, n), slope * a1, bend * a1 * a1 + slope * a2
            i += 1
        elif instruction == WHERE:
            top -= 2
            if values[top] != 0.0:
                a, a1, a2 = values[top + 1], firsts[top + 1], seconds[top + 1]
        elif instruction >= NEGATE:
            slope, bend = slopes_of_one(instruction, a)
            a, a1, a2 = of_one(instruction, a), slope * a1, bend * a1 * a1 + slope * a2
        else:
            top -= 1
            b, b1, b2 = a, a1, a2
            a1, a2 = derivatives_of_two(instruction, values[top], firsts[top], seconds[top], b, b1, b2)
            a = of_two(instruction, values[top], b)
    return a, a1, a2


# ------------------------------------------------------------------------------- laws by expressions, as users' laws


@entry(REAL, REAL, REAL, VECTOR)
@kernel
def spring_expression(x, v, t, p):
    """Tension of a spring, N, or torque of a motor, N m or N; variables x, v, t."""
    variables = local_vector()
    variables[0], variables[1], variables[2] = x, v, t
    return evaluate(p, 0, variables)


@entry(VECTOR, VECTOR, REAL, VECTOR)
@kernel
def force_expression(x, v, t, p):
    """Force per length, N/m; three programs, one after the other, of the variables x, y, z, vx, vy, vz, t.

    Of a torque the rotation matrix follows them, row after row, as it follows the position in x : (12,) float.
    """
    variables = local_vector()
    for c in range(3):
        variables[c], variables[3 + c] = x[c], v[c]
    variables[6] = t
    for c in range(3, x.size):
        variables[4 + c] = x[c]
    second = 1 + int(p[0])
    third = second + 1 + int(p[second])
    return evaluate(p, 0, variables), evaluate(p, second, variables), evaluate(p, third, variables)


@entry(REAL, REAL, REAL, REAL, REAL, VECTOR)
@kernel
def scalar_expression_slope(x, dx, v, dv, t, p):
    """Derivative of `spring_expression` along (dx, dv)."""
    variables, rates = local_vector(), local_vector()
    variables[0], variables[1], variables[2] = x, v, t
    rates[0], rates[1], rates[2] = dx, dv, 0.0
    return evaluate_with_derivatives(p, 0, variables, rates)[1]


@entry(VECTOR, VECTOR, REAL, VECTOR)
@kernel
def force_expression_slope(x, v, t, p):
    """Derivative of `force_expression` along a direction; x, v : twice as long, values and derivatives by turns."""
    variables, rates = local_vector(), local_vector()
    for c in range(3):
        variables[c], rates[c] = x[2 * c], x[2 * c + 1]
        variables[3 + c], rates[3 + c] = v[2 * c], v[2 * c + 1]
    variables[6], rates[6] = t, 0.0
    for c in range(3, x.size // 2):
        variables[4 + c], rates[4 + c] = x[2 * c], x[2 * c + 1]
    second = 1 + int(p[0])
    third = second + 1 + int(p[second])
    return (
        evaluate_with_derivatives(p, 0, variables, rates)[1],
        evaluate_with_derivatives(p, second, variables, rates)[1],
        evaluate_with_derivatives(p, third, variables, rates)[1],
    )


@entry(REAL, VECTOR)
@kernel
def drive_expression(t, p):
    """Angle of a drive, and its derivatives by t."""
    variables, rates = local_vector(), local_vector()
    variables[0], rates[0] = t, 1.0
    return evaluate_with_derivatives(p, 0, variables, rates)


@entry(REAL, VECTOR, VECTOR)
@kernel
def event_expression(t, y, p):
    """Value of an event: p is the number k of variables from the state, their k indices, then the program.

    The program's variables are t and those from the state.
    """
    variables = local_vector()
    k = int(p[0])
    variables[0] = t
    for i in range(k):
        variables[1 + i] = y[int(p[1 + i])]
    return evaluate(p, 1 + k, variables)
