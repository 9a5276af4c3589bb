"""The flow of m a + b v + k x = F a second time, in fifty decimal digits: a power series, halved and squared."""

from __future__ import annotations

from decimal import Decimal, localcontext

DIGITS = 50
Matrix = list[list[Decimal]]


def _product(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    return [[sum((x * y for x, y in zip(row, column, strict=True)), Decimal(0)) for column in columns] for row in a]


def _exponential(rates: Matrix) -> Matrix:
    size, halvings = len(rates), 0
    while max(sum(abs(entry) for entry in row) for row in rates) > Decimal("0.1"):
        rates, halvings = [[entry / 2 for entry in row] for row in rates], halvings + 1
    term = total = [[Decimal(i == j) for j in range(size)] for i in range(size)]
    for order in range(1, 45):
        term = [[entry / order for entry in row] for row in _product(term, rates)]
        total = [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
    for _ in range(halvings):
        total = _product(total, total)
    return total


def flow_minus_identity(mass: float, damping: float, stiffness: float, step_s: float) -> dict[str, float]:
    """The eight coefficients of one step, F linear over it: those of x, v, F(0) and F(h) - F(0) in dx and dv."""
    with localcontext() as context:
        context.prec = DIGITS
        m, b, k, h = (Decimal(number) for number in (mass, damping, stiffness, step_s))
        zero = Decimal(0)
        rates = [
            [zero, h, zero, zero],
            [-k / m * h, -b / m * h, h / m, zero],
            [zero, zero, zero, Decimal(1)],
            [zero, zero, zero, zero],
        ]
        flow = _exponential(rates)
        rows = {"x": [flow[0][0] - 1, *flow[0][1:]], "v": [flow[1][0], flow[1][1] - 1, *flow[1][2:]]}
        names = ("x", "v", "force", "slope")
        return {f"{row}_{name}": float(entry) for row in "xv" for name, entry in zip(names, rows[row], strict=True)}
