"""Who may see what is served: requests with the token of the printed address, from that address, to that address."""

import hmac
import ipaddress
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from aiohttp import web

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

TOKEN = "token"
_EVERYWHERE = ("0.0.0.0", "::")
_HEADERS = {
    "Referrer-Policy": "no-referrer",  # the token stands in the address
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
}


@dataclass(frozen=True, kw_only=True)
class Guard:
    """The token that a request must carry, and the address and port that it must be sent to."""

    token: str
    host: str
    port: int

    @property
    def cookie(self) -> str:
        """Return the name of the cookie that carries the token; other ports of a machine share its cookies."""
        return f"twintip-{self.port}"

    def refusal(self, request: web.Request) -> str | None:
        """Return why a request is refused; None where it is not."""
        if not self._is_own(request.headers.get("Host", "")):
            return "refused: sent to another address than this server's"
        origin = request.headers.get("Origin")
        if origin is not None and origin != f"http://{request.headers['Host']}":
            return "refused: from a page of another origin"
        given = request.query.get(TOKEN) or request.cookies.get(self.cookie, "")
        if not hmac.compare_digest(given.encode(errors="surrogateescape"), self.token.encode()):
            return "refused: open the address that pipeline view printed, with its token"
        return None

    def _is_own(self, host: str) -> bool:
        """Say whether a Host header names this server; one that listens everywhere takes numbers, no names."""
        name, _, port = host.rpartition(":")
        if port != str(self.port):
            return False
        if self.host not in _EVERYWHERE:
            return name in (self.host, f"[{self.host}]")
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return False
        return True


def guarding(guard: Guard) -> Callable[[web.Request, Handler], Awaitable[web.StreamResponse]]:
    """Return the middleware that answers 403 to every request that a guard refuses, websockets included."""

    @web.middleware
    async def middleware(request: web.Request, handler: Handler) -> web.StreamResponse:
        reason = guard.refusal(request)
        if reason is not None:
            return web.Response(status=403, text=f"{reason}\n", headers=_HEADERS)
        response = await handler(request)
        if not response.prepared:
            response.headers.update(_HEADERS)
            response.set_cookie(guard.cookie, guard.token, httponly=True, samesite="Strict", path="/")
        return response

    return middleware
