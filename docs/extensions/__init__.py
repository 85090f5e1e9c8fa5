"""What these pages need beyond Sphinx: pictures made by the code, help texts, equations as MathML, API entries."""
