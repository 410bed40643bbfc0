"""Report of a result: one HTML page that needs nothing else, and the view of the body alone for notebooks.

| file | duty |
|---|---|
| field.py | temperature field of the cross-section (extra `report`) |
| svg.py | charts as SVG, drawn by matplotlib |
| body.py | numbers of the view of the body |
| texts.py | texts and tables |
| document.py | the page from its parts |
| page.py, view.py | the whole report; the body alone |
| page.html, page.css, body.js, section.js, page.js | template, style, drawing and moving |
"""
