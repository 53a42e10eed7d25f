"""``a2v completion``: the shell itself completes."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from pipelines.cli import available, main


@pytest.fixture(scope="module")
def command_line():
    from pipelines.commands.completion import command_line

    return command_line()


def completed(script: str, folder: str, *words: str) -> set[str]:
    """What bash offers for the last word."""
    text = f"""{script}
cd {folder!r}
COMP_WORDS=({" ".join(f"'{word}'" for word in words)}); COMP_CWORD={len(words) - 1}
"$(complete -p a2v | sed 's/.*-F \\([^ ]*\\).*/\\1/')" a2v "${{COMP_WORDS[COMP_CWORD]}}" ''
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=True, timeout=60)
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


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_can_read_their_script(shell, command_line, tmp_path):
    import shtab

    script = shtab.complete(command_line, shell)
    assert "root-motion" in script
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed: its script was written and not tried")
    (tmp_path / "a2v").write_text(script)
    subprocess.run([shell, "-n", str(tmp_path / "a2v")], check=True, timeout=60)
