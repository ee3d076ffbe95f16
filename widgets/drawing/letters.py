"""How wide text is in Source Sans 3, the panels' typeface, so that a label can keep its width."""

from __future__ import annotations

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 \xa0.,:;-–’()%°½/"
_ADVANCES = """
504 553 456 555 496 292 504 544 246 247 495 255 829 547 542 555 555 347 419 338 544 467 719 446 467 425
543 588 571 615 527 494 617 652 263 479 579 486 727 647 664 566 664 569 534 536 645 515 786 513 476 539
497 497 497 497 497 497 497 497 497 497 200 200 249 249 249 249 311 480 249 303 303 824 331 808 350
"""  # thousandths of an em, figures as wide as in tables
WIDTHS = dict(zip(LETTERS, map(int, _ADVANCES.split()), strict=True))
USUAL = 500


def em_width(text: str) -> float:
    """The width of a line of text, in em."""
    return sum(WIDTHS.get(letter, USUAL) for letter in text) / 1000.0
