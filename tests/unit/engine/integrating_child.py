"""A program that integrates x' = u for one entity: reads lines, answers each with one line. It says why it dies on standard error.

step DT U V W -> X Y Z      save -> X Y Z      crash -> (no answer, exit status 3)      sleep S -> awake
"""

import sys
import time


def main() -> None:
    x = [float(word) for word in sys.argv[1:4]]
    print("ready", flush=True)
    for line in sys.stdin:
        command, *words = line.split()
        if command == "step":
            dt, *u = map(float, words)
            x = [a + dt * b for a, b in zip(x, u, strict=True)]
            print(*[value.hex() for value in x], flush=True)
        elif command == "save":
            print(*[value.hex() for value in x], flush=True)
        elif command == "sleep":
            time.sleep(float(words[0]))
            print("awake", flush=True)
        else:
            sys.exit(3)


if __name__ == "__main__":
    main()
