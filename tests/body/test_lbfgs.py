"""The minimizer of every fit of the body."""

import subprocess

from a2v.processes import python_command


def test_it_finds_the_minimum_without_torchs_compiler():
    code = (
        "import sys, torch\n"
        "from a2v.body.lbfgs import minimize\n"
        "x = torch.zeros(3, requires_grad=True)\n"
        "minimize(lambda: ((x - 2) ** 2).sum(), [x], steps=5, history=5)\n"
        "print('torch._dynamo' in sys.modules, x.tolist())\n"
    )
    told = subprocess.run(python_command(code), capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "False [2.0, 2.0, 2.0]"
