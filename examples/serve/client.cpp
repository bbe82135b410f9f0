// A client of `tussle serve` in C++ without libraries: g++ -std=c++17 client.cpp -o client && ./client PORT TOKEN
#include <arpa/inet.h>
#include <iostream>
#include <string>
#include <sys/socket.h>
#include <unistd.h>

int connection;

std::string receive(size_t n) {
  std::string data(n, 0);
  for (size_t have = 0, got; have < n; have += got)
    if ((got = recv(connection, &data[have], n - have, 0)) == 0 || got == size_t(-1)) throw "the server has gone";
  return data;
}

// Sends a text message (RFC 6455: masked, here with zeros) and returns the answer.
std::string ask(const std::string &text) {
  std::string head = "\x81", length = {char(0x80 | 126), char(text.size() >> 8), char(text.size())};
  std::string frame = head + length + std::string(4, '\0') + text;
  send(connection, frame.data(), frame.size(), 0);
  size_t size = (unsigned char)receive(2)[1], more = size == 126 ? 2 : size == 127 ? 8 : 0;
  if (more) size = 0;
  for (unsigned char byte : receive(more)) size = size << 8 | byte;
  return receive(size);
}

int main(int, char **arguments) {
  std::string port = arguments[1], answer;
  sockaddr_in address{AF_INET, htons(std::stoi(port)), {htonl(INADDR_LOOPBACK)}, {}};
  connection = socket(AF_INET, SOCK_STREAM, 0);
  if (connect(connection, (sockaddr *)&address, sizeof address)) return 1;
  std::string request = std::string("GET /") + arguments[2] + " HTTP/1.1\r\nHost: 127.0.0.1:" + port +
      "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  send(connection, request.data(), request.size(), 0);
  while (answer.find("\r\n\r\n") == std::string::npos) answer += receive(1);
  std::cout << ask(R"({"do": "step", "n": 100})") << "\n" << ask(R"({"do": "state_hash"})") << "\n";
  close(connection);
}
