#include "cli/import/command_line.h"
#include "runtime/process/exit.h"

int main(int argc, char** argv) {
  using namespace airworthy;
  const auto request = importer::parse_command_line(argc, argv);
  if (!request) return request.error();
  importer::stop_on_signals();
  const auto logs = importer::run(*request);
  return logs ? importer::report(*logs, *request) : rt::fail(logs.error().exit_code, logs.error().error);
}
