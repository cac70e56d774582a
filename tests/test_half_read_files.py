"""No damaged file is read by halves in silence; the script of faults tries more."""

import pytest
from half_readers import READERS, fault_of

COUNT = 60


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_as_what_is_in_it_or_refused(name, tmp_path):
    reader = READERS[name]
    refused = 0
    for number, mutant in enumerate(reader.mutants(COUNT, seed=number_of(name))):
        folder = tmp_path / str(number)
        folder.mkdir()
        fault = fault_of(reader, mutant, folder)
        assert not fault, f"{mutant.what}: {fault}"
        refused += fault is None
    assert 0 < refused < COUNT


def number_of(name):
    """Return a seed of each reader."""
    return list(READERS).index(name)
