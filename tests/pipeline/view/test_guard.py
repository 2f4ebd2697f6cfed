"""A request is answered only with the token, to this address, from this address's own page; websockets too."""

import asyncio
from types import SimpleNamespace

import aiohttp
import pytest
from aiohttp import web

from pipeline.view.serving.guard import Guard, guarding

TOKEN, HOST = "secret-of-the-test", "127.0.0.1"


async def asked(headers: dict[str, str], query: str, path: str = "/page", host: str = HOST) -> tuple[int, str]:
    """Return the status and the cookie of an answer of a guarded server."""

    async def page(_: web.Request) -> web.Response:
        return web.Response(text="scene")

    async def socket(request: web.Request) -> web.WebSocketResponse:
        opened = web.WebSocketResponse()
        await opened.prepare(request)
        await opened.close()
        return opened

    application = web.Application()
    application.add_routes([web.get("/page", page), web.get("/ws", socket)])
    runner = web.AppRunner(application)
    listening = web.TCPSite
    guards: list[Guard] = []

    @web.middleware
    async def late(request: web.Request, handler):
        return await guarding(guards[0])(request, handler)

    application.middlewares.append(late)
    await runner.setup()
    await listening(runner, HOST, 0).start()
    port = runner.addresses[0][1]
    guards.append(Guard(token=TOKEN, host=host, port=port))
    filled = {name: value.replace("PORT", str(port)) for name, value in headers.items()}
    try:
        async with aiohttp.ClientSession(headers=filled, cookie_jar=aiohttp.DummyCookieJar()) as session:
            if path == "/ws":
                try:
                    async with session.ws_connect(f"http://{HOST}:{port}/ws{query}") as opened:
                        await opened.close()
                    return 101, ""
                except aiohttp.WSServerHandshakeError as error:
                    return error.status, ""
            async with session.get(f"http://{HOST}:{port}{path}{query}") as answer:
                return answer.status, answer.headers.get("Set-Cookie", "")
    finally:
        await runner.cleanup()


OWN = {"Origin": f"http://{HOST}:PORT"}
STRANGERS = {
    "no token": ({}, ""),
    "another token": ({}, "?token=guess"),
    "token of another length": ({}, f"?token={TOKEN}x"),
    "letters beyond ASCII": ({}, "?token=%C3%A9"),
    "another cookie": ({"Cookie": f"twintip-1={TOKEN}"}, ""),
    "another origin": ({"Origin": "http://example.org"}, f"?token={TOKEN}"),
    "another port's origin": ({"Origin": f"http://{HOST}:1"}, f"?token={TOKEN}"),
    "origin of no page": ({"Origin": "null"}, f"?token={TOKEN}"),
    "another host": ({"Host": "example.org:PORT"}, f"?token={TOKEN}"),
    "host by a name": ({"Host": "localhost:PORT"}, f"?token={TOKEN}"),
    "host without port": ({"Host": HOST}, f"?token={TOKEN}"),
    "rebound name": ({"Host": "evil.test:PORT", "Origin": "http://evil.test:PORT"}, f"?token={TOKEN}"),
}  # fmt: skip


@pytest.mark.parametrize("path", ["/page", "/ws"])
@pytest.mark.parametrize("case", STRANGERS)
def test_stranger_is_refused(case, path):
    assert asyncio.run(asked(*STRANGERS[case], path)) == (403, "")


def test_cookie_that_is_no_text_is_refused():
    """The server decodes such bytes to surrogates; a client of Python sends none."""
    guard = Guard(token=TOKEN, host=HOST, port=1)
    cookies = {guard.cookie: b"\xff\xfe".decode(errors="surrogateescape")}
    request = SimpleNamespace(headers={"Host": f"{HOST}:1"}, query={}, cookies=cookies)
    assert "with its token" in (guard.refusal(request) or "")


@pytest.mark.parametrize("headers", [{}, OWN])
def test_token_opens_the_page_and_leaves_a_cookie_of_this_port(headers):
    status, cookie = asyncio.run(asked(headers, f"?token={TOKEN}"))
    assert status == 200
    assert cookie.startswith("twintip-")
    assert all(word in cookie for word in (TOKEN, "HttpOnly", "SameSite=Strict"))


@pytest.mark.parametrize("path", ["/page", "/ws"])
def test_cookie_opens_page_and_websocket(path):
    status, _ = asyncio.run(asked({**OWN, "Cookie": f"twintip-PORT={TOKEN}"}, "", path))
    assert status == (200 if path == "/page" else 101)


@pytest.mark.parametrize(
    ("host", "status"), [("192.0.2.7:PORT", 200), ("[2001:db8::7]:PORT", 200), ("evil.test:PORT", 403)]
)
def test_server_that_listens_everywhere_takes_numbers_and_no_names(host, status):
    """A name may be made to point here by whoever owns it; a number may not."""
    found, _ = asyncio.run(asked({"Host": host}, f"?token={TOKEN}", host="0.0.0.0"))
    assert found == status
