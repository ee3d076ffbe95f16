"""The authors' content, parsed and checked: chapters, slides, terms, references, claims and placed figures."""
