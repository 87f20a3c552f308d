"""A run in three dimensions. One concept a file:

- ``replay``: what stands where at an instant; ``charts``: what is drawn over time
- ``stage``, ``trails``, ``solids``, ``camera``, ``colours``, ``chart_html``: how it looks
- ``viewer``, ``panel``, ``clock``, ``server``, ``live``: the page on a server, of a run that may still go on
- ``page``: the page without a server
"""
