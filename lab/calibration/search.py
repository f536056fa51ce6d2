# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The search for the best fit: seeded CMA-ES with a log from which it can resume.

The log has one line of JSON for the problem and one for every candidate. The same search tries
the same candidates, and those in the log are not simulated again. An interrupted search
therefore resumes where it stopped and gives the same result.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
import hashlib
from itertools import chain
import json
import math
from pathlib import Path
from typing import Any, TextIO

from antenna_drive.workers import workers
import cma
from lab.calibration.problem import CalibrationProblem, Evaluation
import numpy as np
from simgap.errors import UserError

# A candidate is given up once it costs more than this times the worst candidate of the better half
# of the last generation.
_GIVE_UP = 1.5


@dataclass(frozen=True)
class FitCandidate:
    """A candidate: its parameters as shares of the bounds, and its evaluation."""

    shares: tuple[float, ...]
    evaluation: Evaluation


@dataclass(frozen=True)
class SearchResult:
    """The result of a search."""

    best: FitCandidate  # the best candidate
    candidates: tuple[FitCandidate, ...]  # all of them in order; the first is the start


def _begin_log(path: Path, problem: CalibrationProblem, seed: int) -> list[FitCandidate]:
    """Return the candidates that the log of this search holds; begin the log if there is none."""
    head = {'problem': _digest(problem), 'seed': seed}
    if not path.exists():
        path.write_text(json.dumps(head) + '\n', encoding='utf-8')
        return []
    found, candidates = read_log(path)
    if found != head:
        raise UserError(f'{path}: belongs to another search (targets, start or seed differ), give '
                        '--log another file or remove it')
    whole, _, cut = path.read_text(encoding='utf-8').rpartition('\n')
    if cut:
        # drop a line that an interruption cut short; its candidate is simulated again
        path.write_text(f'{whole}\n', encoding='utf-8')
    return candidates


def read_log(path: Path) -> tuple[dict[str, Any], list[FitCandidate]]:
    """Return head and candidates of any search's log, but for a line cut short; or UserError."""
    try:
        lines = path.read_text(encoding='utf-8').splitlines(keepends=True)
        head = json.loads(lines[0])
        if 'problem' not in head:
            raise KeyError('problem')
        entries = (json.loads(line) for line in lines[1:] if line.endswith('\n'))
        return head, [FitCandidate(tuple(entry['shares']), Evaluation(
            entry['cost'], entry['figures'], entry['complete'])) for entry in entries]
    except OSError as error:
        raise UserError(f'{path}: cannot be read, {error.strerror}') from error
    except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        raise UserError(f'{path}: is not the log of a search: {error}') from error


def _digest(problem: CalibrationProblem) -> str:
    """Return a digest that identifies the problem."""
    said = repr((problem.free, problem.targets, problem.population, problem.spread,
                 problem.parameters(problem.start())))
    return hashlib.sha256(said.encode()).hexdigest()[:16]


def search(problem: CalibrationProblem, count: int, *, seed: int = 1, log: Path | None = None,
           progress: Callable[[int, FitCandidate], None] | None = None, jobs: int = 1,
           scheduler: str | None = None) -> SearchResult:
    """
    Search for the parameters of least cost.

    problem : the fit
    count : candidates to try; the search ends with a whole generation
    seed : the same seed gives the same search
    log : file for the candidates; the search resumes from it if it exists
    progress : called with the number of candidates so far and the best one
    jobs : processes that evaluate the candidates of a generation
    scheduler : address of a dask.distributed scheduler whose workers do that instead

    Raises UserError: the log belongs to another search, or cannot be read or written; the
    scheduler has no workers.
    """
    known = [] if log is None else _begin_log(log, problem, seed)
    start = problem.start()
    candidates = [FitCandidate(tuple(start), problem.evaluate(start))]
    random = np.random.default_rng(seed)
    strategy = cma.CMAEvolutionStrategy(start, problem.spread, {
        'bounds': [0.0, 1.0], 'popsize': problem.population, 'verbose': -9, 'seed': math.nan,
        'randn': lambda *shape: random.standard_normal(shape), 'maxiter': math.inf})
    with (nullcontext() if log is None else log.open('a', encoding='utf-8') as stream,
          _evaluators(problem, jobs, scheduler) as evaluated):
        limit = math.inf
        while len(candidates) <= count and not strategy.stop():
            asked = strategy.ask()
            generation = []
            # those of this generation that the log holds
            logged = known[len(candidates) - 1:][:len(asked)]
            for candidate, shares in zip(logged, asked):
                if not np.allclose(candidate.shares, shares, rtol=0.0, atol=1e-9):
                    raise UserError(f'{log}: does not repeat (another version of a library?), '
                                    'remove it to start again')
            for number, candidate in enumerate(chain(
                    logged, evaluated(asked[len(logged):], limit))):
                if stream and number >= len(logged):
                    _write(stream, candidate)
                candidates.append(candidate)
                generation.append(candidate.evaluation.cost)
                if progress:
                    progress(len(candidates) - 1, _best(candidates))
            strategy.tell(asked, generation)
            limit = _GIVE_UP * sorted(generation)[len(generation) // 2]
    return SearchResult(_best(candidates), tuple(candidates))


@contextmanager
def _evaluators(problem: CalibrationProblem, jobs: int, scheduler: str | None) -> Iterator[
        Callable[[Sequence[Any], float], Iterator[FitCandidate]]]:
    """Yield a function that evaluates candidates and yields them in their order."""
    if jobs == 1 and scheduler is None:
        yield lambda asked, limit: (_evaluated(problem, shares, limit) for shares in asked)
        return
    with workers(jobs, scheduler) as pool:
        def side_by_side(asked: Sequence[Any], limit: float) -> Iterator[FitCandidate]:
            ended: dict[int, FitCandidate] = {}
            following = 0
            for number, result in pool.each(_evaluated, (
                    (problem, shares, limit) for shares in asked)):
                ended[number] = result()
                while following in ended:
                    yield ended.pop(following)
                    following += 1

        yield side_by_side


def _evaluated(problem: CalibrationProblem, shares: Sequence[float], limit: float,
               ) -> FitCandidate:
    return FitCandidate(tuple(map(float, shares)), problem.evaluate(shares, limit))


def _best(candidates: list[FitCandidate]) -> FitCandidate:
    return min((item for item in candidates if item.evaluation.complete),
               key=lambda item: item.evaluation.cost)


def _write(stream: TextIO, candidate: FitCandidate) -> None:
    evaluation = candidate.evaluation
    stream.write(json.dumps({
        'shares': candidate.shares, 'cost': evaluation.cost, 'complete': evaluation.complete,
        'figures': dict(evaluation.figures)}) + '\n')
    stream.flush()
