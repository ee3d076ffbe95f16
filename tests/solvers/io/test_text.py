"""What all readers of files have in common."""

import pytest

from solvers import cloud_text, g2o
from solvers.odometry import read_drive

# The first bytes of a small compressed file, as each tool writes them.
HEADS = {
    "gzip": "1f8b080000000000000353d42933e4",
    "zip": "504b03041400000000000000210087",
    "bzip2": "425a683931415926535990d9d3c400",
    "xz": "fd377a585a000004e6d6b4460200",
    "zstd": "28b52ffd2012910000782c790a30",
}


@pytest.mark.parametrize("read", [cloud_text.read, g2o.read, read_drive])
@pytest.mark.parametrize("name", HEADS)
def test_a_compressed_file_is_told_as_such(read, name):
    with pytest.raises(ValueError, match=rf"^the file is compressed \({name}\); decompress it first$"):
        read(bytes.fromhex(HEADS[name]))
