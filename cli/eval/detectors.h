#pragma once

#include <string>
#include <vector>

#include "cli/eval/flight_run.h"

namespace airworthy::eval {

/// A detector that `airworthy eval` can run beside the response detector, which it knows more about.
struct ConfiguredDetector {
  std::string process;  ///< "airworthy-unbalance"
  std::string vehicle;  ///< that its configuration names
  /// Puts it on a node of the flight's vehicle; it writes into the log, which must live as long, when it judges.
  std::function<Detector(rt::Node& node, JudgementLog& judgement)> make;
};

/// The words for `--detector`, "response" first.
[[nodiscard]] const std::vector<std::string>& detector_names();

/// Any detector but "response", from its configuration file.
[[nodiscard]] rt::Expected<ConfiguredDetector> load_detector(const std::string& name,
                                                             const std::string& config_path,
                                                             const std::vector<std::string>& overrides);

}  // namespace airworthy::eval
