#include "likeness/train/peers.h"

#define USE_DISTRIBUTED
#define USE_C10D_GLOO
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <torch/csrc/distributed/c10d/PrefixStore.hpp>
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>
#ifdef LIKENESS_NCCL
#define USE_C10D_NCCL
#include <torch/csrc/distributed/c10d/ProcessGroupNCCL.hpp>
#endif

#include "likeness/base/error.h"

namespace likeness {
namespace {

bool IsLoopback(const std::string& address) { return address == "localhost" || address.starts_with("127."); }

// A socket that listens on this machine alone; LibTorch's own would listen everywhere.
int ListenOnLoopback(int port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      listen(descriptor, 1024) != 0) {
    const std::string reason = std::strerror(errno);
    close(descriptor);
    throw Error("port {} (MASTER_PORT) cannot be listened on: {}", port, reason);
  }
  return descriptor;
}

// The first line, without LibTorch's own addresses in its source.
std::string Reason(const std::exception& error) {
  const std::string text = error.what();
  const std::string line = text.substr(0, text.find('\n'));
  const size_t bracket = line.rfind("] ");
  return bracket == std::string::npos ? line : line.substr(bracket + 2);
}

[[noreturn]] void Lost(const std::exception& error) {
  throw Error(
      "another process of this run has ended or cannot be reached ({}); this one ends too. Start again with any number "
      "of processes: training goes on from the last checkpoint",
      Reason(error));
}

}  // namespace

struct Peers::Group {
  c10::intrusive_ptr<c10d::Store> store;
  c10::intrusive_ptr<c10d::Backend> backend;
};

Peers::Peers() = default;
Peers::~Peers() = default;

Peers::Peers(const Launcher& launcher, torch::Device device, double timeout_s)
    : rank_(launcher.rank), count_(launcher.count), device_(device) {
  if (count_ == 1) return;
  group_ = std::make_unique<Group>();
  const std::chrono::milliseconds timeout(static_cast<int64_t>(1000 * timeout_s));
  const bool loopback = IsLoopback(launcher.address);
  try {
    c10d::TCPStoreOptions store;
    store.port = static_cast<uint16_t>(launcher.port);
    store.isServer = IsFirst() && !launcher.has_store;
    store.numWorkers = count_;
    store.timeout = timeout;
    if (store.isServer && loopback) store.masterListenFd = ListenOnLoopback(launcher.port);
    // Runs that torchrun starts anew share its store with the earlier ones.
    const char* attempt = std::getenv("TORCHELASTIC_RESTART_COUNT");
    group_->store =
        c10::make_intrusive<c10d::PrefixStore>(fmt::format("likeness {}", attempt != nullptr ? attempt : "0"),
                                               c10::make_intrusive<c10d::TCPStore>(launcher.address, store));
    if (device.is_cuda()) {
#ifdef LIKENESS_NCCL
      const auto options = c10d::ProcessGroupNCCL::Options::create();
      options->timeout = timeout;
      group_->backend = c10::make_intrusive<c10d::ProcessGroupNCCL>(group_->store, rank_, count_, options);
#else
      throw Error("this program was built without NCCL: several processes can train on the CPU only");
#endif
    } else {
      const auto options = c10d::ProcessGroupGloo::Options::create();
      options->timeout = timeout;
      const char* interface = std::getenv("GLOO_SOCKET_IFNAME");
      options->devices.push_back(interface != nullptr ? c10d::ProcessGroupGloo::createDeviceForInterface(interface)
                                 : loopback           ? c10d::ProcessGroupGloo::createDeviceForHostname("127.0.0.1")
                                                      : c10d::ProcessGroupGloo::createDefaultDevice());
      group_->backend = c10::make_intrusive<c10d::ProcessGroupGloo>(group_->store, rank_, count_, options);
    }
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error("process {} of {} did not find the others at {}:{} within {:g} s: {}", rank_, count_, launcher.address,
                launcher.port, timeout_s, Reason(error));
  }
}

void Peers::Broadcast(const std::vector<torch::Tensor>& tensors) const {
  if (count_ == 1) return;
  const torch::NoGradGuard no_grad;
  try {
    for (const torch::Tensor& tensor : tensors) {
      std::vector<torch::Tensor> values = {tensor.detach().to(device_).contiguous()};
      group_->backend->broadcast(values)->wait();
      if (!IsFirst()) tensor.copy_(values[0]);
    }
  } catch (const std::exception& error) {
    Lost(error);
  }
}

std::function<void()> Peers::BeginSum(const torch::Tensor& tensor) const {
  if (count_ == 1) return [] {};
  try {
    std::vector<torch::Tensor> values = {tensor};
    return [work = group_->backend->allreduce(values)] {
      try {
        work->wait();
      } catch (const std::exception& error) {
        Lost(error);
      }
    };
  } catch (const std::exception& error) {
    Lost(error);
  }
}

void Peers::Sum(std::span<double> values) const {
  if (count_ == 1) return;
  const torch::Tensor here = torch::from_blob(values.data(), {static_cast<int64_t>(values.size())}, torch::kFloat64);
  const torch::Tensor sum = here.to(device_, /*non_blocking=*/false, /*copy=*/true);
  BeginSum(sum)();
  here.copy_(sum);
}

}  // namespace likeness
