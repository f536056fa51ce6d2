# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The continuous coupling of a wiring's blocks: what is computed in which order, as program text.

An input that is another block's state is read off the states. Any other is computed as soon as
what it depends on is there: by the rates of the block that puts it out if they come first, or by
an equation of its own (`physics.block.Equation`). Blocks that feed each other in a loop without a
state in it cannot be ordered, and are refused.
"""

from collections.abc import Callable, Collection, Mapping, Sequence

from antenna_drive.emulator.kernels import blocks
from antenna_drive.emulator.wiring import Wiring
from simgap.errors import UserError

# An input's value or slope: the unit, the number of the input, 0 or 1. What feeds it: the signal.
_Place = tuple[str, int, int]
_Source = tuple[str, int]


class Coupling:
    """
    Program text for the blocks of a wiring, whose states and modes lie one after another.

    In the text x, mode, p and dx are those of the whole drive, u_NAME the inputs of a block, and
    t the time since the start of the step.

    table, blocks : an expression for each signal of the source, and the blocks, by name
    u : the NAME of the u_NAME that a block reads
    functions : what the text calls, by name
    inputs : the number of inputs in each u_NAME
    """

    def __init__(self, wiring: Wiring, table: Mapping[str, str]) -> None:
        """Lay out states and modes; `table` has an expression for each signal of the source."""
        self.table = table
        self.blocks = blocks(wiring)
        self._sources = {name: wiring.units[name].sources for name in self.blocks}
        # blocks that are fed alike share their inputs
        self.u = {name: next(other for other, fed in self._sources.items() if fed == own)
                  for name, own in self._sources.items()}
        self.inputs = {name: len(self._sources[name]) for name in dict.fromkeys(self.u.values())}
        self.functions = {f'{kind}_{name}': getattr(block, kind)
                          for name, block in self.blocks.items()
                          for kind in ('start', 'rates', 'switch', 'read') if getattr(block, kind)}
        # a block whose number of states depends on its parameters comes last
        order = sorted(self.blocks, key=lambda name: self.blocks[name].more_states is not None)
        if sum(block.more_states is not None for block in self.blocks.values()) > 1:
            raise UserError(f'{", ".join(order[-2:])}: only one block of a drive may have a '
                            'number of states that depends on its parameters')
        self._x: dict[str, str] = {}
        self._mode: dict[str, str] = {}
        self._state: dict[str, int] = {}
        state = mode = 0
        for name in order:
            block, self._state[name] = self.blocks[name], state
            end = '' if block.more_states else state + len(block.states)
            self._x[name] = f'x[{state}:{end}]'
            self._mode[name] = f'mode[{mode}:{mode + len(block.modes)}]'
            state += len(block.states)
            mode += len(block.modes)

    def start(self) -> str:
        """Return the text that starts every block; x and mode are zero before."""
        return _lines([f'start_{name}(p[0].{name}, {self._x[name]}, {self._mode[name]})'
                       for name in self.blocks])

    def rates(self) -> str:
        """Return the text that writes all derivatives."""
        return self._text(
            self.blocks, lambda name: [self.call('rates', name, f'd{self._x[name]}')],
            derivatives=True)

    def switch(self) -> str:
        """Return the text that tells whether a mode has to change, and changes those that do."""
        names = [name for name, block in self.blocks.items() if block.switch]
        return self._text(names, lambda name: [
            'if changed and not commit:', '    return True',
            f'changed |= {self.call("switch", name, "commit")}'])

    def sample(self, channels: tuple[str, ...]) -> str:
        """Return the text that reads outputs, and values of states, into the rows of out."""
        wanted: dict[str, list[tuple[int, str]]] = {}
        states: list[str] = []
        for row, channel in enumerate(channels):
            name, _, output = channel.partition('/')
            if any(signal.name == output for signal in self.blocks[name].outputs):
                wanted.setdefault(name, []).append((row, output))
            else:
                states.append(f'out[{row}, 0] = x[{self.place(name, output)}]')

        def read(name: str) -> list[str]:
            rows = [signal.name for signal in self.blocks[name].outputs]
            return [f'read_{name}({self._x[name]}, {self._mode[name]}, u_{self.u[name]}, 0.0, '
                    f'p.{name}, y)', *(f'out[{row}, {n}] = y[{rows.index(output)}, {n}]'
                                       for row, output in wanted[name] for n in range(2))]

        return _lines([self._text(wanted, read, slopes=False), *states])

    def call(self, function: str, name: str, *more: str) -> str:
        own = (self._x[name], self._mode[name], f'u_{self.u[name]}', f'p.{name}')
        return f'{function}_{name}(0.0, {", ".join((*own, *more))})'

    def _text(self, names: Collection[str], act: Callable[[str], list[str]],
              derivatives: bool = False, slopes: bool = True) -> str:
        """
        Return the text that lets blocks act, each once its inputs are there.

        `derivatives` says that a block that has acted has written its derivatives, `slopes` that
        it uses those of its inputs.
        """
        inputs = _Inputs(self)
        text: list[str] = []
        waiting = {name: self._needed(name, slopes) for name in self.blocks if name in names}
        while waiting:
            ways = ((name, inputs.fill(needed, by_equation))
                    for by_equation in ((False, True) if derivatives else (True,))
                    for name, needed in waiting.items())
            name, lines = next(((name, lines) for name, lines in ways if lines is not None),
                               ('', []))
            if not name:
                raise UserError(f'{", ".join(waiting)}: feed each other in a loop without a '
                                'state in it, or by an output without an Equation')
            inputs.filled.update((place, self.source(place)) for place in waiting.pop(name))
            text += [*lines, *act(name)]
            if derivatives:
                inputs.acted.add(name)
        return _lines(text)

    def _needed(self, name: str, slopes: bool) -> list[_Place]:
        inputs = self.blocks[name].inputs._fields
        used = self.blocks[name].slopes_used if slopes else ()
        return [*((self.u[name], row, 0) for row in range(len(inputs))),
                *((self.u[name], inputs.index(item), 1) for item in used)]

    def source(self, place: _Place) -> _Source:
        name, row, column = place
        return self._sources[name][row], column

    def place(self, name: str, state: str) -> int:
        return self._state[name] + int(getattr(self.blocks[name].states, state))


class _Inputs:
    """The inputs of a coupling that are filled so far, and the blocks that have acted."""

    def __init__(self, coupling: Coupling) -> None:
        self.filled: dict[_Place, _Source] = {}
        self.acted: set[str] = set()
        self._of = coupling

    def fill(self, places: Collection[_Place], by_equation: bool, above: tuple[_Place, ...] = (),
             ) -> list[str] | None:
        """Return what fills these inputs, None if one of them cannot be filled yet."""
        text: list[str] = []
        for place in places:
            if place in self.filled:
                continue
            right = None if place in above else self._value(
                self._of.source(place), by_equation, (*above, place))
            if right is None:
                return None
            text += right[:-1]
            if right[-1]:
                text.append(f'u_{place[0]}[{place[1]}, {place[2]}] = {right[-1]}')
        return text

    def _value(self, source: _Source, by_equation: bool, above: tuple[_Place, ...],
               ) -> list[str] | None:
        """Return what is to be done first, then an expression, '' for what stays zero."""
        of, (signal, column) = self._of, source
        if signal in of.table:
            return [of.table[signal]] if column == 0 else None
        for (name, row, _), known in self.filled.items():
            if known == source:
                return [f'u_{name}[{row}, {column}]']
        name, _, output = signal.partition('/')
        block = of.blocks[name]
        is_state = output in block.states._fields
        if is_state and column == 0:
            return [f'x[{of.place(name, output)}]']
        equations = block.slopes if column else block.values
        equation = equations.get(output)
        if output in equations and equation is None:
            return ['']
        rate_of = output if is_state else equation.rate_of if equation else ''
        if rate_of and name in self.acted:
            return [f'dx[{of.place(name, rate_of)}]']
        if equation is None or not by_equation:
            return None
        first = self.fill([(of.u[name], block.inputs._fields.index(item), 0)
                           for item in equation.feedthrough], by_equation, above)
        if first is None:
            return None
        function = f'{"slope" if column else "value"}_{output}'
        of.functions[f'{function}_{name}'] = equation.function
        return [*first, of.call(function, name)]


def _lines(lines: Sequence[str]) -> str:
    return '\n    '.join(lines)
