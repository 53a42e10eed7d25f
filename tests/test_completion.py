"""``a2v completion``: completion in real shells."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import shutil
import struct
import subprocess
import termios
import time

import pytest

from pipelines.cli import available, main


@pytest.fixture(scope="module")
def command_line():
    from pipelines.commands.completion import command_line

    return command_line()


def completed(script: str, folder: str, *words: str) -> set[str]:
    """Return what bash offers for the last word."""
    text = f"""{script}
cd {folder!r}
COMP_WORDS=({" ".join(f"'{word}'" for word in words)}); COMP_CWORD={len(words) - 1}
"$(complete -p a2v | sed 's/.*-F \\([^ ]*\\).*/\\1/')" a2v "${{COMP_WORDS[COMP_CWORD]}}" ''
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    done = subprocess.run(
        ["bash", "-c", text], capture_output=True, text=True, check=True, timeout=60
    )
    return {line.strip() for line in done.stdout.splitlines()}


def test_bash_completes_commands_options_choices_and_files(capsys, tmp_path):
    if shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    (tmp_path / "me.jpg").touch()
    folder = str(tmp_path)
    assert completed(script, folder, "a2v", "") >= set(available())
    assert completed(script, folder, "a2v", "vid") == {"video"}
    assert completed(script, folder, "a2v", "train", "fl") == {"flow"}
    assert "--root-motion" in completed(script, folder, "a2v", "video", "--root")
    assert "mixamo" in completed(script, folder, "a2v", "video", "--rig", "m")
    assert "me.jpg" in completed(script, folder, "a2v", "video", "--photo", "m")


ASKED = {
    "a2v vid": "video",
    "a2v train fl": "flow",
    "a2v video --root": "--root-motion",
    "a2v video --rig mix": "mixamo",
    "a2v video --photo m": "me.jpg",
}
"""Lines, and what their last word becomes."""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "me.jpg").touch()
    return tmp_path


def script_for(shell, command_line):
    import shtab

    script = shtab.complete(command_line, shell)
    assert "root-motion" in script
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed: its script was written and not tried")
    return script


def test_fish_completes_the_same(command_line, folder):
    (folder / "a2v.fish").write_text(script_for("fish", command_line))
    code = "source a2v.fish; " + "; ".join(
        f"echo '== {line}'; complete -C '{line}'" for line in ASKED
    )
    home = {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    done = subprocess.run(
        ["fish", "--no-config", "-c", code],
        cwd=folder,
        env={**os.environ, **home},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    parts = (part.partition("\n") for part in done.stdout.split("== ")[1:])
    offered = {
        line: {word.partition("\t")[0] for word in words.splitlines()} for line, _, words in parts
    }
    assert {line for line, word in ASKED.items() if word not in offered[line]} == set()


def test_zsh_completes_the_same(command_line, folder):
    """Type each line at a terminal, then TAB and `echo GOT ` in front of it."""
    (folder / "_a2v").write_text(script_for("zsh", command_line))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 300, 0, 0))
    environment = {**os.environ, "TERM": "dumb", "HOME": str(folder), "ZDOTDIR": str(folder)}
    shell = subprocess.Popen(
        ["zsh", "-f", "-i"],
        cwd=folder,
        env=environment,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    )
    seen = ""

    def until(text):
        nonlocal seen
        seen, deadline = "", time.monotonic() + 60
        while text not in seen:
            assert time.monotonic() < deadline, seen[-500:]
            if select.select([ours], [], [], 1)[0]:
                seen += os.read(ours, 65536).decode(errors="replace")

    try:
        os.write(
            ours,
            b"PROMPT=; fpath=($PWD $fpath); autoload -Uz compinit; compinit -u -d dump; bindkey "
            b"-e; echo READ''Y\n",
        )
        until("READY")
        for line, word in ASKED.items():
            os.write(ours, f"{line}\t\x01echo G''OT \n".encode())
            until(f"GOT {line.rpartition(' ')[0]} {word}")
    finally:
        shell.kill()
        shell.wait()
        os.close(ours)
        os.close(theirs)
