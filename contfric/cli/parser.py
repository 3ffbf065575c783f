"""The arguments of the command line."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from contfric.cli import commands
from contfric.errors import ContfricError, did_you_mean
from contfric.models import DEFAULT_MODEL

_COMMANDS = (
    *("run", "explain", "info", "signatures", "check", "graph", "simulate", "census", "view"),
    *("doctor", "verify", "certify"),
)
_DEBUG = "show the traceback of an error"
_PARAMETER = "a parameter, such as Omega=0.5 or S0=S; may be repeated"
_STUDY = "YAML file, or name of a bundled study"


class UsageError(ContfricError):
    """The command line cannot be read."""


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, and raised."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see: {self.prog} --help)")


class _Version(argparse.Action):
    """Print the version; it is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from contfric.study.record import package_version

        print(f"contfric {package_version()}")
        parser.exit()


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options; ``options.command(options)`` runs the command.

    Raises
    ------
    UsageError
        If the arguments are not valid.
    """
    first = next((a for a in arguments if not a.startswith("-")), None)
    if first is not None and first not in _COMMANDS:
        raise UsageError(f"unknown command '{first}'{did_you_mean(first, _COMMANDS)}")
    options, unknown = _parser().parse_known_args(_joined(arguments))
    if (
        unknown
    ):  # argparse would point to the help of the program, which has no options of a command
        of = f"contfric {first}" if first is not None else "contfric"
        values = [text for text in unknown if "=" in text and not text.startswith("-")]
        advice = f"a parameter is -p {values[0]}; " if values and hasattr(options, "params") else ""
        raise UsageError(f"unrecognized arguments: {' '.join(unknown)} ({advice}see: {of} --help)")
    return options


def _joined(arguments: Sequence[str]) -> list[str]:
    """Join ``--state -1,0`` to ``--state=-1,0``: argparse takes a leading minus for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] == "--state":
            joined[-1] = f"--state={argument}"
        else:
            joined.append(argument)
    return joined


def _parser() -> _Parser:
    parser = _Parser(
        prog="contfric",
        description="Periodic orbits and bifurcations of oscillators with dry friction, impacts or switches.",
        epilog="STUDY is the path of a YAML file or the name of a bundled study, such as fig05.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    parser.add_argument("--debug", action="store_true", help=_DEBUG)
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)

    def add(name: str, command: commands.Command, text: str) -> argparse.ArgumentParser:
        return _described(
            subparsers.add_parser(name, help=text, description=text, allow_abbrev=False), command
        )

    _fill_run(add("run", commands.run, "compute what a study wants, and write the results"))
    _fill_explain(add("explain", commands.explain, "print the plan of a study; compute nothing"))
    _fill_info(add("info", commands.info, "print what a run folder holds"))
    _fill_signatures(
        add("signatures", _of("signatures", "list_all"), "list, show or check signatures")
    )
    _fill_check(add("check", commands.check, "verify a model: derivatives, transitions, symmetry"))
    _fill_graph(add("graph", commands.graph, "print or draw the transitions of a model"))
    _fill_simulate(add("simulate", commands.simulate, "print the events of a trajectory as CSV"))
    _fill_census(add("census", commands.census, "list all periodic orbits, stable or not"))
    _fill_view(
        add("view", _of("view", "view"), "write the diagram of a run folder as a page to click on")
    )
    _fill_certify(add("certify", _of("certify", "certify"), "prove the diagram of a run folder"))
    _fill_verify(add("verify", _of("verify", "verify"), "check a certificate file, independently"))
    _fill_doctor(
        add("doctor", _of("doctor", "doctor"), "say what is compiled, and compile what is not")
    )
    return parser


def _of(module: str, name: str) -> commands.Command:
    """Return a command; its module is imported when it is called."""

    def command(options: argparse.Namespace) -> int:
        code: int = getattr(import_module(f"contfric.cli.{module}"), name)(options)
        return code

    return command


def _described(
    parser: argparse.ArgumentParser, command: commands.Command
) -> argparse.ArgumentParser:
    # SUPPRESS: `contfric --debug run` must not be undone by the default of `run`
    parser.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=_DEBUG)
    parser.set_defaults(command=command)
    return parser


def _fill_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", metavar="STUDY", help=_STUDY)
    parser.add_argument("--out", metavar="DIR", help="folder of the results (default: ./NAME)")
    parser.add_argument("--json", action="store_true", help="print run.json to stdout")
    parser.add_argument("--force", action="store_true", help="replace results of an earlier run")
    parser.add_argument("--quiet", action="store_true", help="no progress, no summary")


def _fill_explain(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", metavar="STUDY", help=_STUDY)


def _fill_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", type=Path, help="folder of a run")


def _fill_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", type=Path, help="folder of a run")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    parser.add_argument(
        "--live", action="store_true", help="serve it with sliders for the fixed parameters"
    )


def _fill_certify(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("folder", metavar="DIR", type=Path, help="folder of a run")
    add("--jobs", type=_count, default=1, metavar="N", help="number of processes (%(default)s)")
    add("--time-limit", type=_number, metavar="SECONDS", help="end after this many seconds")
    add("--quiet", action="store_true", help="no progress")


def _fill_verify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a certificate (JSON)")


def _fill_doctor(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--compile", action="store_true", help="compile all kernels that are not in the cache")
    add("--workers", type=_count, metavar="N", help="number of processes (default: one a core)")


def _fill_signatures(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(metavar="list|show|check", required=True)
    listing = actions.add_parser(
        "list", help="names, periods and segments of all signatures", allow_abbrev=False
    )
    _described(listing, _of("signatures", "list_all"))
    listing.add_argument("--model", help="those of this model only")
    showing = actions.add_parser(
        "show", help="one signature, as a signature file", allow_abbrev=False
    )
    _described(showing, _of("signatures", "show"))
    showing.add_argument("name", metavar="NAME", help="a name, or the path of a file")
    checking = actions.add_parser(
        "check", help="read signature files and say what is wrong", allow_abbrev=False
    )
    _described(checking, _of("signatures", "check"))
    checking.add_argument("files", metavar="FILE", nargs="+", type=Path)


def _fill_check(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("model", metavar="MODEL", nargs="?", help="name or YAML file of a model")
    add("--model", dest="also_model", metavar="MODEL", help="the same, as other commands take it")
    _add_params(parser, "check it at this value of a parameter")
    add("--json", action="store_true", help="print everything as JSON")


def _fill_graph(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model", default=DEFAULT_MODEL, help="name or YAML file of the model (%(default)s)"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, help="draw it: .png, .svg or .pdf")


def _fill_simulate(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--model", default=DEFAULT_MODEL, help="name or YAML file of the model (%(default)s)")
    _add_params(parser)
    add(
        "--state",
        metavar="X,V",
        help="initial state: numbers joined by commas, in the order of the states",
    )
    add("--time", type=_number, default=0.0, help="initial time (%(default)s)")
    add("--domain", help="initial domain, where the state alone does not decide")
    add(
        "--periods",
        type=_number,
        default=100.0,
        help="length, in periods of excitation or clock (%(default)s)",
    )
    add("--events", type=_count, default=1_000_000, help="largest number of events (%(default)s)")
    add("--find", action="store_true", help="say on stderr what the solution converges to")


def _fill_census(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("old_model", metavar="MODEL", nargs="?", help=argparse.SUPPRESS)  # as it was
    add("--model", default=DEFAULT_MODEL, help="name or YAML file of the model (%(default)s)")
    _add_params(parser)
    add("--periods", type=_count, default=2, help="largest number of periods (%(default)s)")
    add("--stops", type=_count, default=6, help="largest number of stops, v = 0 (%(default)s)")
    add(
        "--finer",
        type=int,
        default=0,
        help="halve all cells of the grids so often, 0 to 3 (%(default)s)",
    )
    add("--seed", type=int, default=0, help="shifts the grids of starts (%(default)s)")
    add("--json", action="store_true", help="print everything as JSON")
    add("--quiet", action="store_true", help="no progress")


def _add_params(parser: argparse.ArgumentParser, what: str = _PARAMETER) -> None:
    names = "-p", "--param"
    parser.add_argument(
        *names, dest="params", metavar="NAME=VALUE", action="append", default=[], help=what
    )


def _number(text: str) -> float:
    return float(text)


_number.__name__ = "number"  # argparse names the type in its message


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError(text)
    return value


_count.__name__ = "whole number >= 1"
