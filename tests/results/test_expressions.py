"""An expression of a declaration computes with values, and can neither hang nor fill the memory."""

import signal
import subprocess
import sys
import threading

import pytest

from cembench.core.errors import ParameterError
from cembench.results import expressions
from cembench.results.expressions import computed, with_words
from cembench.results.frame import evaluate


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1.01 * x + 2 ** 10", 1.01 * 3 + 1024),
        ("f'{x:,.1f} of {2 * x:g}'", "3.0 of 6"),
        ("'none' * (x > 2) + f'{7 % x}'", "none1"),
        ("[*[1, 2], x][1:] if x != 2 and not x < 1 else -x", [2, 3]),
    ],
)
def test_what_declarations_need_is_computed(expression, value):
    assert evaluate(expression, {"x": 3}) == value


@pytest.mark.parametrize(
    ("expression", "said"),
    [
        ("9 ** 9 ** 9", "bits; allowed are"),
        ("2 ** 1000 * 2 ** 1000", "bits; allowed are"),
        ("'a' * 10 ** 11", "characters or entries; allowed are"),
        ("10 ** 11 * [1]", "characters or entries; allowed are"),
        ("long + long", "characters or entries; allowed are"),
        ("f'{long}{long}'", "characters or entries; allowed are"),
        ("'%100000000000d' % 1", "% is for numbers"),
        ("f'{x:100000000000}'", "more than an expression over columns: it has a width"),
        ("f'{x:.99999999g}'", "it has a width"),
        ("f'{x:{x}}'", "it has a width"),
        ("(yield)", "it has Yield"),
        ("(yield from x)", "it has YieldFrom"),
        ("{x: 1 for x in [1]}", "it has DictComp"),
        ("1 << 10 ** 11", "it has LShift"),
        ("lambda: 1", "it has Lambda"),
        ("-" * 100_000 + "1", "has 100,001 characters"),
        ("-" * 3_000 + "1", "is no expression|more than 40 deep"),
        ("(" * 1_900 + "1" + ")" * 1_900, "is no expression|more than 40 deep"),
        ("[" * 60 + "]" * 60, "more than 40 deep"),
        ("sign_test(10 ** 9, 10 ** 9)", "is of 10,000 surfaces at most"),
        ("len(significant(1 / 3, 10 ** 8)) + ''", "unsupported operand"),
    ],
)
def test_what_would_hang_or_fill_the_memory_is_refused(expression, said):
    with pytest.raises(ParameterError, match=said) as caught:
        evaluate(expression, {"x": 3}, {"long": "a" * 90_000})
    assert len(str(caught.value)) < 1000


def test_an_expression_has_so_many_seconds_of_the_processor(monkeypatch):
    monkeypatch.setattr(expressions, "MAX_SECONDS", 0.05)

    def endless():
        while True:
            pass

    before = signal.getsignal(signal.SIGVTALRM)
    with pytest.raises(ParameterError, match=r"it takes more than 0\.05 s of CPU time"):
        evaluate("endless()", {}, {"endless": endless})
    assert signal.getsignal(signal.SIGVTALRM) is before
    assert not any(signal.getitimer(signal.ITIMER_VIRTUAL))


def test_in_another_thread_expressions_are_computed_too():
    found = []
    thread = threading.Thread(target=lambda: found.append(computed("1 + 1", {})))
    thread.start()
    thread.join()
    assert found == [2]


INTERRUPTED = """
import os, signal, threading
from cembench.results.frame import evaluate

def endless():
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    while True:
        pass

try:
    evaluate("endless()", {}, {"endless": endless})
except KeyboardInterrupt:
    print("ended")
"""


@pytest.mark.process
def test_ctrl_c_ends_it():
    ended = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, check=False
    )
    assert ended.stdout == "ended\n", ended.stderr


@pytest.mark.parametrize("text", ["{x:100000000000}", "{x.real}", "{x[0]}", "{x:{x}}"])
def test_words_in_braces_are_names_with_a_format_of_a_few_digits(text):
    assert with_words("{x:.1f} and {}", "a", x=2) == "2.0 and a"
    with pytest.raises(ValueError, match="more than a name with a format of a few digits"):
        with_words(text, x=2)
