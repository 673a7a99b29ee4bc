#include "server/query/grpc/describe_models.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <set>

#include "tests/unit/server/fake_model.h"
#include "tests/unit/server/quick_served_model.h"

namespace grouser::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using v1alpha1::GetModelResponse;
using v1alpha1::ListModelsRequest;
using v1alpha1::ListModelsResponse;

std::shared_ptr<const ServedModel> Serve(const std::string& name, int runs, int name_bytes) {
  auto message = testing::FakeMessage(name, 0.1);
  message.mutable_soil()->set_name(std::string(name_bytes, 's'));
  for (int i = 0; i < runs; ++i) {
    auto* run = message.mutable_provenance()->add_runs();
    run->set_run_id("0123456789abcdef");
    run->set_file("0123456789abcdef.run.h5");
    run->set_sha256(std::string(64, 'a'));
    for (int k = 0; k < 6; ++k)
      run->add_mean(0.1 * k), run->add_standard_error(1), run->add_drift(1);
    for (int k = 0; k < 72; ++k) run->mutable_stress()->add_normal_pa(1e4 + k);
    message.add_errors()->set_output("f_x");
  }
  return testing::QuickServedModel(std::move(message), std::string(64, 'd'));
}

Snapshot MakeSnapshot(int models, int runs = 0, int name_bytes = 8) {
  std::vector<Snapshot::ModelPtr> all;
  for (int i = 0; i < models; ++i) all.push_back(Serve(fmt::format("m{:04}", i), runs, name_bytes));
  return {1, all, {}};
}

/// Names of all pages; every page is below 1 MB.
std::vector<std::string> AllNames(const Snapshot& snapshot, int page_size) {
  std::vector<std::string> names;
  ListModelsRequest request;
  request.set_page_size(page_size);
  do {
    ListModelsResponse page;
    EXPECT_TRUE(ListModels(snapshot, request, &page).ok());
    EXPECT_LT(page.ByteSizeLong(), 1'000'000u);
    for (const auto& model : page.models()) names.push_back(model.name());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return names;
}

TEST(ListModels, PagesHoldEveryModelOnceBelowAMegabyte) {
  for (const int page_size : {0, 1, 7, 250, 1'000'000}) {
    const auto names = AllNames(MakeSnapshot(250, 3), page_size);
    EXPECT_EQ(names.size(), 250u);
    EXPECT_EQ(std::set(names.begin(), names.end()).size(), 250u);
  }
  // Long names end a page before its size does, also where two would just not fit.
  EXPECT_EQ(AllNames(MakeSnapshot(40, 0, 100'000), 40).size(), 40u);
  EXPECT_EQ(AllNames(MakeSnapshot(5, 0, 510'000), 40).size(), 5u);
}

TEST(ListModels, TokensOutliveModelsThatComeAndGo) {
  ListModelsRequest request;
  request.set_page_size(2);
  ListModelsResponse first, second;
  ASSERT_TRUE(ListModels(MakeSnapshot(4), request, &first).ok());
  ASSERT_EQ(first.models(1).name(), "m0001");
  request.set_page_token(first.next_page_token());
  const Snapshot later(2, {Serve("a", 0, 1), Serve("m0000", 0, 1), Serve("m0002", 0, 1)}, {});
  ASSERT_TRUE(ListModels(later, request, &second).ok());
  ASSERT_EQ(second.models_size(), 1);
  EXPECT_EQ(second.models(0).name(), "m0002");
  EXPECT_EQ(second.next_page_token(), "");
}

TEST(ListModels, RefusesWhatNoPageGave) {
  ListModelsRequest request;
  ListModelsResponse response;
  const std::string digest(64, 'd');
  for (const std::string& bad :
       {std::string("page 2"), std::string("@sha256:"), std::string("m0000@sha256:dddddddddddd"),
        "m0000@sha256:" + digest + "d", "m0000@sha256:x" + digest.substr(1),
        std::string(100'000, 'x')}) {
    request.set_page_token(bad);
    const Status token = ListModels(MakeSnapshot(1), request, &response);
    EXPECT_EQ(token.code, StatusCode::kInvalidArgument) << bad.substr(0, 99);
    EXPECT_THAT(token.message, AllOf(HasSubstr("page_token: '" + bad.substr(0, 99)),
                                     HasSubstr("expected the next_page_token")));
    EXPECT_LT(token.message.size(), 300u);
  }
  request.Clear();
  request.set_page_size(-1);
  EXPECT_THAT(ListModels(MakeSnapshot(1), request, &response).message, HasSubstr("page_size: -1"));
}

TEST(GetModel, HasErrorsAndProvenanceOfAThousandRunsInAStockClientsMessage) {
  v1alpha1::GetModelRequest request;
  request.set_model("m0000@sha256:" + std::string(64, 'd'));
  GetModelResponse response;
  const Snapshot snapshot = MakeSnapshot(1, 1000);
  ASSERT_TRUE(GetModel(snapshot, request, &response).ok());
  EXPECT_EQ(response.model().runs(), 1000u);
  EXPECT_EQ(response.provenance().runs_size(), 1000);
  EXPECT_EQ(response.errors_size(), 1000);
  EXPECT_FALSE(response.provenance().runs(0).has_stress());
  EXPECT_LT(response.ByteSizeLong(), 1'000'000u);
  request.set_model("nothing");
  EXPECT_EQ(GetModel(snapshot, request, &response).code, StatusCode::kNotFound);
}

}  // namespace
}  // namespace grouser::server
