"""What a Recording shows in a notebook: its page. `mechlab.api` offers it to the experiments, which know no pages."""

from __future__ import annotations

from mechlab.experiment.recording import Recording


def recording_page(recording: Recording) -> str:
    """The offline page of a run in a frame. Raises MechlabError where it is too large or the viewer is not installed."""
    from mechlab.api.viewing import story
    from mechlab.viewer import story_to_html
    from mechlab.viewer.notebook import framed

    told = story(recording)
    return framed(story_to_html(told), told.title)
