"""What the program tells of itself for man(1) and for shells.

    python tests/manual_test.py
"""
import gzip
import os
import pathlib
import pty
import re
import select
import shlex
import shutil
import subprocess
import tempfile
import time
import unittest

from ygslam_cli import BINARY, HANG_S, CliTest, ygslam


def commands_and_options():
    """Command to the long options that its --help names; the program's own under ''."""
    def options(*command):
        text = ygslam(*command, "--help").stdout
        heads = re.findall(r"(?m)^ +((?:-\w,)?--[a-z][^ ]*)", text)
        return text, {name for head in heads for name in re.findall(r"--[a-z-]+", head)}
    text, own = options()
    table = {"": own}
    for name in re.findall(r"(?m)^  ([a-z]+) ", text.partition("Subcommands:")[2]):
        text, table[name] = options(name)
        for sub in re.findall(r"(?m)^  ([a-z]+) ", text.partition("Subcommands:")[2]
                              .partition("\n\n")[0]):
            table[f"{name} {sub}"] = options(name, sub)[1]
    return table


@unittest.skipUnless(shutil.which("help2man"), "no help2man here")
class Manual(CliTest):
    PAGE = pathlib.Path(BINARY).with_name("ygslam.1.gz")

    def shown(self):
        done = subprocess.run(["man", "--warnings", "-l", str(self.PAGE)], check=False,
                              capture_output=True, text=True,
                              env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANWIDTH": "100",
                                   "MANROFFOPT": "-c", "PAGER": "cat"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return re.sub(".\b", "", done.stdout)

    def test_it_tells_of_every_command_option_and_setting(self):
        text = gzip.decompress(self.PAGE.read_bytes()).decode().replace("\\-", "-")
        table = commands_and_options()
        self.assertGreater(len(table), 15, table)
        self.assertIn("map info", table)
        sections = dict(re.findall(r'(?ms)^\.SH "?([^"\n]*)"?\n(.*?)(?=^\.SH|\Z)', text))
        self.assertLessEqual({name.upper() for name in table} - {""}, set(sections))
        for command, options in table.items():
            for option in options - {"--help"} - (table[""] if command else set()):
                self.assertIn(option, sections.get(command.upper(), text), command)
        keys = [line.split()[0] for line in ygslam("config").stdout.splitlines() if line[0] != " "]
        for key in keys:
            self.assertIn(key, sections["SETTINGS"])

    @unittest.skipUnless(shutil.which("man") and shutil.which("groff"), "no man here")
    def test_man_shows_it_without_a_word_of_complaint(self):
        text = self.shown()
        for words in ("ygslam - RGB-D SLAM", "--segmenter model|builtin|none|masks:DIR",
                      "ygslam map merge monday.map tuesday.map -o both.map", "dynamic.mode"):
            self.assertIn(words, text)


class Completion(CliTest):
    SHELL = "bash"

    def setUp(self):
        super().setUp()
        script = self.folder / "completion" / "_ygslam"
        script.parent.mkdir()
        done = ygslam("completion", self.SHELL)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        script.write_text(done.stdout, encoding="utf-8")
        self.script = script

    def offered(self, *words):
        """What bash offers for the last word, as it splits the words itself."""
        split = [part for word in words for part in (re.split("(=)", word) if "=" in word
                                                     else [word])]
        if split[-1] == "" and len(split) > 1 and split[-2] == "=":
            split.pop()
        done = subprocess.run(
            ["bash", "-c", 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _ygslam; '
             'printf "%s\\n" "${COMPREPLY[@]}"', self.script, "ygslam", *split], check=False,
            capture_output=True, text=True, cwd=self.folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return set(done.stdout.split("\n")) - {""}

    def test_commands_and_their_options(self):
        table = commands_and_options()
        self.assertEqual(self.offered(""), {name for name in table if " " not in name} - {""})
        self.assertEqual(self.offered("re"), {"render"})
        self.assertEqual(self.offered("map", ""), {"info", "check", "recover", "export", "merge"})
        for command, options in table.items():
            self.assertEqual(self.offered(*command.split(), "--"), options | table[""], command)
        self.assertEqual(self.offered("run", "--view-t"), {"--view-token"})
        self.assertEqual(self.offered("--quiet", "run", "--determ"), {"--deterministic"})

    def test_values(self):
        self.assertEqual(self.offered("run", "SEQ", "--dynamic", "s"), {"semantic"})
        self.assertEqual(self.offered("run", "--segmenter", ""), {"model", "builtin", "none", "masks:"})
        self.assertEqual(self.offered("simulate", "--format", ""), {"jpg", "png"})
        self.assertEqual(self.offered("run", "--seed", ""), set())
        self.assertEqual(self.offered("completion", ""), {"bash", "zsh"})
        keys = {line.split()[0] + "=" for line in ygslam("config").stdout.splitlines()
                if line[0] != " "}
        self.assertEqual(self.offered("run", "SEQ", "--set", ""), keys)
        self.assertEqual(self.offered("run", "SEQ", "--set", "dynamic.mo"), {"dynamic.mode="})
        self.assertEqual(self.offered("run", "SEQ", "--set", "dynamic.mode="),
                         {"off", "geometry", "semantic", "full"})
        self.assertEqual(self.offered("run", "SEQ", "--set", "dynamic.mode=se"), {"semantic"})

    def test_worlds_files_and_folders(self):
        worlds = {line.split()[0] for line in ygslam("simulate", "--list").stdout.splitlines()}
        self.assertEqual(self.offered("simulate", ""), worlds | {"completion"})
        (self.folder / "walking tour").mkdir()
        (self.folder / "walk.yaml").write_text("", encoding="utf-8")
        self.assertEqual(self.offered("simulate", "walking"), {w for w in worlds
                                                               if w.startswith("walking")}
                         | {"walking tour"})
        self.assertEqual(self.offered("run", "walk"), {"walk.yaml", "walking tour"})
        self.assertEqual(self.offered("run", "SEQ", "--out", "walk"), {"walking tour"})
        self.assertEqual(self.offered("run", "SEQ", "--config", "walk"), {"walk.yaml",
                                                                          "walking tour"})

    def test_a_shell_it_does_not_know_is_refused(self):
        done = ygslam("completion", "tcsh")
        self.assertEqual((done.returncode, done.stdout), (2, ""))


# Notes what is offered for a line, ends the shell after it.
ZSH = """
cd $1; fpath=($2 $fpath); autoload -Uz compinit; compinit -u -d $3/dump
if [[ -n $4 ]]; then source $2/_ygslam; fi
compadd() {
  local -a hits
  if [[ ${@[1,(i)(-|--)]} != *-(O|A|D)\ * ]]; then
    builtin compadd -A hits "$@"
    print -rl -- $hits >>$3/hits
  fi
  builtin compadd "$@"
}
note_end() { print >$3/ended; exit }
comppostfuncs=(note_end)
unset zle_bracketed_paste; setopt no_beep; bindkey '^I' complete-word
"""


@unittest.skipUnless(shutil.which("zsh"), "no zsh here")
class ZshCompletion(Completion):
    """The same, in a terminal of its own."""
    SHELL = "zsh"
    SOURCED = ""

    def test_it_need_not_be_installed(self):
        self.SOURCED = "sourced"
        self.assertEqual(self.offered("re"), {"render"})

    def offered(self, *words):
        with tempfile.TemporaryDirectory() as notes:
            pathlib.Path(notes, ".zshrc").write_text(
                f"set -- {shlex.join([str(self.folder), str(self.script.parent), notes, self.SOURCED])}"
                + ZSH.replace("$3", notes), encoding="utf-8")
            pid, terminal = pty.fork()
            if pid == 0:
                os.execvpe("zsh", ["zsh", "-d", "-i"], {**os.environ, "ZDOTDIR": notes, "TERM": "dumb",
                                                         "LC_ALL": "C.UTF-8"})
            os.write(terminal, (" ".join(["ygslam", *words]) + "\t").encode())
            end = time.monotonic() + HANG_S
            while select.select([terminal], [], [], max(0, end - time.monotonic()))[0]:
                try:
                    if not os.read(terminal, 4096):
                        break
                except OSError:  # as Linux tells that nobody is there any more
                    break
            os.close(terminal)
            os.waitpid(pid, 0)
            self.assertTrue(pathlib.Path(notes, "ended").exists(), "zsh completed nothing")
            hits = pathlib.Path(notes, "hits")
            text = hits.read_text(encoding="utf-8") if hits.exists() else ""
            return set(re.sub(r"\\(.)", r"\1", text).split("\n")) - {""}  # names come quoted


if __name__ == "__main__":
    unittest.main()
