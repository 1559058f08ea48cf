"""Access to the server: requests need the token, a known Host and an Origin of our own; others are refused at once.

A page of another site can make a browser send requests to 127.0.0.1, also under a name that resolves to it (DNS
rebinding). The token protects against both; Host and Origin are checked first.
"""

import hmac
import http.cookies
import secrets
import urllib.parse
from collections.abc import Iterable
from typing import Any

OPEN_PATHS = ("/page/",)  # style and scripts, without anything secret
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
#: of every response: only our own page may frame, load and read it (OWASP's list of secure headers)
HEADERS = {
    "content-security-policy": "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*; base-uri 'none'; form-action 'none'; "
    "object-src 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
    "x-permitted-cross-domain-policies": "none",
}


class Gate:
    """ASGI middleware in front of everything."""

    def __init__(self, app: Any, host: str, port: int, token: str | None = None) -> None:
        self.app, self.port = app, port
        self.token = token or secrets.token_urlsafe(18)
        self.cookie = f"wavetank_{port}"
        # Other than on loopback the names of this machine are unknown; there only the token is checked.
        self.hosts = {f"{name}:{port}" for name in (*LOOPBACK, host)} if is_loopback(host) else None

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on or refuse it (ASGI)."""
        if scope["type"] not in ("http", "websocket"):
            return
        headers = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        if not self._is_allowed(scope, headers):
            await _refuse(scope, receive, send)
            return
        if scope["type"] == "http":
            send = self._with_headers(send, scope)
        await self.app(scope, receive, send)

    def _is_allowed(self, scope: Any, headers: dict[str, str]) -> bool:
        host, origin = headers.get("host", ""), headers.get("origin")
        if self.hosts is not None and host.lower() not in self.hosts:
            return False
        if origin is not None and _host_of(origin) != host.lower():
            return False
        # Browsers always send the Origin of a socket; other clients need the token as well.
        if scope["type"] == "http" and scope["path"].startswith(OPEN_PATHS):
            return True
        return any(hmac.compare_digest(given.encode(), self.token.encode()) for given in self._tokens(scope, headers))

    def _tokens(self, scope: Any, headers: dict[str, str]) -> Iterable[str]:
        query = urllib.parse.parse_qs(scope.get("query_string", b"").decode("latin-1"))
        yield from query.get("token", [])
        try:
            cookies = http.cookies.SimpleCookie(headers.get("cookie", ""))
        except http.cookies.CookieError:
            return
        if self.cookie in cookies:
            yield cookies[self.cookie].value

    def _with_headers(self, send: Any, scope: Any) -> Any:
        async def wrapped(message: Any) -> None:
            if message["type"] == "http.response.start":
                extra = dict(HEADERS)
                if scope["path"] == "/":
                    extra["set-cookie"] = f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
                names = {key.encode() for key in extra}
                kept = [(key, value) for key, value in message["headers"] if key.lower() not in names]
                message["headers"] = kept + [(key.encode(), value.encode()) for key, value in extra.items()]
            await send(message)

        return wrapped


def _host_of(origin: str) -> str | None:
    """Return host and port of an Origin; None where it is malformed."""
    try:
        return urllib.parse.urlsplit(origin).netloc.lower()
    except ValueError:
        return None


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach a server that listens on `host`."""
    return host in ("localhost", "::1", "[::1]") or host.startswith("127.")


async def _refuse(scope: Any, receive: Any, send: Any) -> None:
    kind = "http.response"
    if scope["type"] == "websocket":
        await receive()
        kind = "websocket.http.response"
        if kind not in (scope.get("extensions") or {}):
            await send({"type": "websocket.close", "code": 1008})
            return
    body = b"wavetank: open this page with the link that the program printed, which includes the token.\n"
    # The web socket library adds the length itself.
    length = [(b"content-length", str(len(body)).encode())] if scope["type"] == "http" else []
    await send(
        {
            "type": f"{kind}.start",
            "status": 403,
            "headers": [
                (b"content-type", b"text/plain; charset=utf-8"),
                *length,
                *((name.encode(), value.encode()) for name, value in HEADERS.items()),
            ],
        }
    )
    await send({"type": f"{kind}.body", "body": body})
