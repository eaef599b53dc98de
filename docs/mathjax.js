// Formulas of pages come in \( \), those of notebooks in dollars; code is left alone.
window.MathJax = { tex: { inlineMath: [["\\(", "\\)"], ["$", "$"]], displayMath: [["\\[", "\\]"], ["$$", "$$"]] } };
