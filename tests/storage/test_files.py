"""Files that are whole or not there, what is put aside, and tables that grow."""

import resource
from pathlib import Path

import pytest

from parcontact.storage import files
from parcontact.storage.tables import GrowingTable


def test_names_of_unfinished_files_cannot_be_guessed(tmp_path: Path) -> None:
    """Two in a row differ, and what is there already is never opened."""
    path = tmp_path / "table"
    assert files.unused(path) != files.unused(path)
    with files.replaced(path) as file:
        file.write(b"new")
        part = next(tmp_path.iterdir())
        with pytest.raises(FileExistsError):
            part.open("xb")
    assert [found.name for found in tmp_path.iterdir()] == ["table"]
    with pytest.raises(ZeroDivisionError), files.replaced(path) as file:
        file.write(b"half" * (1 // 0))
    assert (path.read_bytes(), len(list(tmp_path.iterdir()))) == (b"new", 1)


def test_links_and_directories_too(tmp_path: Path) -> None:
    """What a link leads to is not asked: the link itself is a user's. An error leaves all as it was."""
    marked = tmp_path / "marked"
    marked.write_text(files.MARK)
    link, directory = tmp_path / "link", tmp_path / "directory"
    link.symlink_to(marked)
    directory.mkdir()
    for path in (link, directory):
        with pytest.raises(ZeroDivisionError), files.replaced(path, files.is_marked):
            raise ZeroDivisionError
        assert not list(tmp_path.glob("*.aside"))
        with files.replaced(path, files.is_marked) as file:
            file.write(b"new")
        assert path.read_text() == "new"
        path.with_name(f"{path.name}.aside").rename(tmp_path / f"kept {path.name}")
    assert (tmp_path / "kept link").readlink() == marked
    assert (tmp_path / "kept directory").is_dir()


def test_a_line_without_room_leaves_the_table_as_it_was(tmp_path: Path) -> None:
    """Under a limit of the size of files, as on a full disk."""
    path, limits = tmp_path / "table.csv", resource.getrlimit(resource.RLIMIT_FSIZE)
    table = GrowingTable(path, ["step", "time"])
    table.append(["0", "0.0"])
    before = path.read_bytes()
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 3, limits[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            table.append(["1", "0.125"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    table.append(["1", "0.125"])
    table.sync()
    table.close()
    again = GrowingTable(path, ["step", "time"])
    again.append(["2", "0.25"])
    again.close()
    assert path.read_text() == "step,time\n0,0.0\n1,0.125\n2,0.25\n"
