"""Where a person gives the token, once for a browser."""

from __future__ import annotations

import asyncio

from tornado.web import RequestHandler

from hil.page.access import COOKIE, Access
from hil.page.views.rendering import template

WAIT_S = 0.5
"""How long a wrong token waits for its answer [s]: trying them one by one takes longer than anybody lives."""

KEPT_DAYS = 30


class SignIn(RequestHandler):
    """The form and its answer."""

    def initialize(self, access: Access) -> None:
        """access : whose token it is."""
        self._access = access

    def get(self) -> None:
        """The form."""
        self._form("")

    async def post(self) -> None:
        """Compare, and let in."""
        if not self._access.knows(self.get_body_argument("token", "")):
            await asyncio.sleep(WAIT_S)
            self.set_status(403)
            self._form("This is not the token. It stands in the file that the monitor was started with.")
            return
        self.set_cookie(
            COOKIE, self._access.cookie(), expires_days=KEPT_DAYS, httponly=True, secure=True, samesite="Strict"
        )
        self.redirect("/", status=303)

    def _form(self, complaint: str) -> None:
        self.finish(template("sign_in.html").render(complaint=complaint))
