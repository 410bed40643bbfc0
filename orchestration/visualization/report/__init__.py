"""Looking at a result: one sheet of charts, a moving picture, an interactive page.

| file | what |
|---|---|
| geometry.py, manipulator.py | the body in space, out of a result |
| field.py | the temperature field of its cross-section |
| charts.py | what is shown over time, with labels and units |
| plot.py, animation.py | drawn by matplotlib |
| figures.py, about.py, page.py, page.* | the page, drawn by plotly (extra `report`) |
"""
