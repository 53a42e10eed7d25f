"""The papers' own reconstruction from the user's checkpoints: PIFuHD's geometry, PIFu's colors
(Sec. 4.2.1 of the journal paper).

The networks are implemented from Saito et al. 2019 and 2020; weights are not shipped (PIFu's are
MIT, PIFuHD's CC BY-NC).
"""

from a2v.lab.papers.surface import PapersSettings, papers_surface

__all__ = ["PapersSettings", "papers_surface"]
