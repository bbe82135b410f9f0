"""A client of `tussle serve`: python examples/serve/client.py ws://127.0.0.1:8123/TOKEN."""

import asyncio
import json
import sys
from typing import Any

import aiohttp


async def main(url: str) -> None:
    """Play 30 s and print how many prey are left."""
    async with aiohttp.ClientSession() as session, session.ws_connect(url, max_msg_size=0) as socket:

        async def ask(command: str, **fields: object) -> dict[str, Any]:
            await socket.send_json({"do": command, **fields})
            answer: dict[str, Any] = json.loads((await socket.receive()).data)
            if "error" in answer:
                raise SystemExit(answer["error"])
            return answer

        print((await ask("describe"))["mission"])
        for _ in range(3):
            now = await ask("step", n=100)
            alive = (await ask("read", path="prey.pos"))["mask"]
            print(f"{now['t'][0]:.0f} s: {sum(alive[0])} prey")


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
