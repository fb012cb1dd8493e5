"""Looking at mechanisms: a Story becomes a page in one file, a live page, or a picture."""

from mechlab.viewer.html_page import story_to_html, write_page
from mechlab.viewer.story import Part, Plot, Story, from_poses

__all__ = ["Part", "Plot", "Story", "from_poses", "story_to_html", "write_page"]
